"""The measurements that planegrasp reports: docs/benchmarks.md defines each of them."""
