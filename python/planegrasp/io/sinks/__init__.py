"""Where results go: JSON Lines, annotated images; Rerun recordings are in `planegrasp.viz`."""

from planegrasp.io.sinks.annotated_images import AnnotatedImageWriter
from planegrasp.io.sinks.as_dict import detection_to_dict, face_report_to_dict, frame_to_dict
from planegrasp.io.sinks.json_lines import JsonLinesWriter
from planegrasp.io.sinks.live_lines import LiveLinesWriter, live_frame_to_dict
from planegrasp.io.sinks.summary import ObjectSummary, Summary

__all__ = [
    "AnnotatedImageWriter",
    "JsonLinesWriter",
    "LiveLinesWriter",
    "ObjectSummary",
    "Summary",
    "detection_to_dict",
    "face_report_to_dict",
    "frame_to_dict",
    "live_frame_to_dict",
]
