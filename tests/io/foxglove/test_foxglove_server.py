"""The live server, as a client of its protocol sees it."""

from __future__ import annotations

import socket
import threading
import time

import pytest
from recorded_frames import frame

from planegrasp.errors import InvalidInputError, ViewerError
from planegrasp.io.foxglove import FoxgloveStream, FoxgloveTopics, ServerAddress, pictures

pytest.importorskip("websockets")
from foxglove_client import PROTOCOL, FoxgloveClient
from mcap_contents import contents, schemas

TOPICS = FoxgloveTopics()
ANY = ServerAddress(port=0)


def wait_for_subscribers(stream, *, there=True):
    """Subscriptions are asked for and not answered; who is gone is noticed some time later."""
    end = time.monotonic() + 20
    while stream._channels.color.has_sinks() != there:
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_client_gets_what_the_file_gets(watched, tmp_path):
    objects, _, seen = watched
    with FoxgloveStream(objects) as stream:
        server = stream.serve(ANY)
        with FoxgloveClient(server.url) as client:
            assert client.protocol == PROTOCOL
            assert client.info["name"] == "planegrasp"
            client.subscribe(topic for topic in client.channels if topic != TOPICS.color)
            client.subscribe([TOPICS.color])
            wait_for_subscribers(stream)
            stream.log_to(tmp_path / "run.mcap")
            stream.note("begun")
            for one in seen:
                stream.live(one)
            offered = {topic: one["schemaName"] for topic, one in client.channels.items()}
            found = contents_after_closing(stream, tmp_path)
            expected = sum(map(len, found.values()))
            received = {}
            for _ in range(expected):
                topic, stamp, message = client.receive()
                received.setdefault(topic, []).append((stamp, message))
    assert offered | schemas(tmp_path / "run.mcap") == offered
    assert received.keys() == found.keys()
    for topic, messages in found.items():
        assert [stamp for stamp, _ in received[topic]] == [stamp for stamp, _ in messages]
        for (_, one), (_, other) in zip(received[topic], messages, strict=True):
            assert same(one, other), topic


def contents_after_closing(stream, folder):
    stream.log.close()
    stream.log = None
    return contents(folder / "run.mcap")


def same(one, other):
    """Decoded messages are of classes that were made apart."""
    if isinstance(one, dict):
        return one == other
    return one.SerializeToString() == other.SerializeToString()


def test_clients_come_go_and_come_late(watched):
    objects, _, seen = watched
    with FoxgloveStream(objects) as stream:
        server = stream.serve(ANY)
        stream.live(seen[0])
        with FoxgloveClient(server.url) as first:
            first.subscribe([TOPICS.color])
            wait_for_subscribers(stream)
            stream.live(seen[1])
            assert first.receive()[0] == TOPICS.color
        wait_for_subscribers(stream, there=False)
        stream.live(seen[2])
        with FoxgloveClient(server.url) as late:
            late.subscribe([TOPICS.transforms, TOPICS.calibration, TOPICS.color])
            wait_for_subscribers(stream)
            stream.live(seen[3])
            got = {late.receive()[0] for _ in range(3)}
        assert got == {TOPICS.transforms, TOPICS.calibration, TOPICS.color}


def test_images_that_nobody_wants_are_not_made(monkeypatch):
    made = []
    monkeypatch.setattr(pictures, "color_image", lambda *_: made.append(1))
    with FoxgloveStream() as stream:
        stream.serve(ANY)
        stream.detections(frame(0), [])
    assert not made


def test_a_client_that_does_not_read_holds_up_nobody(tmp_path):
    """Its connection stays open, and the file gets every frame."""
    with FoxgloveStream() as stream:
        server = stream.serve(ANY)
        log = stream.log_to(tmp_path / "run.mcap")
        frames = [frame(i, size=(320, 240)) for i in range(60)]

        def log_all():
            for one in frames:
                stream.detections(one, [])

        with FoxgloveClient(server.url) as client:
            client.subscribe([TOPICS.color, TOPICS.depth, TOPICS.cloud])
            wait_for_subscribers(stream)
            logging = threading.Thread(target=log_all, daemon=True)
            logging.start()
            logging.join(60)
            assert not logging.is_alive(), "it waits for the client"
        assert log.frames == 60


def test_a_port_is_taken_and_free_again():
    with FoxgloveStream() as stream:
        port = stream.serve(ANY).address.port
        with (
            FoxgloveStream() as other,
            pytest.raises(ViewerError, match=rf"at 127\.0\.0\.1:{port} \(Address already in use"),
        ):
            other.serve(ServerAddress(port=port))
    end = time.monotonic() + 20
    while time.monotonic() < end:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)):
                break
    with FoxgloveStream() as again:
        assert again.serve(ServerAddress(port=port)).address.port == port


def test_an_address_of_others():
    with (
        FoxgloveStream() as stream,
        pytest.raises(ViewerError, match=r"cannot be served at 203\.0\.113\.7:0 \(Cannot assign"),
    ):
        stream.serve(ServerAddress("203.0.113.7", 0))


@pytest.mark.parametrize(
    ("text", "host", "port", "network"),
    [
        ("", "127.0.0.1", 8765, False),
        ("0.0.0.0:9000", "0.0.0.0", 9000, True),
        ("9000", "127.0.0.1", 9000, False),
        (":9000", "127.0.0.1", 9000, False),
        ("robot", "robot", 8765, True),
        ("::1", "::1", 8765, False),
        ("::", "::", 8765, True),
        ("fe80::", "fe80::", 8765, True),
        ("fe80::1%eth0", "fe80::1%eth0", 8765, True),
        ("[::1]", "::1", 8765, False),
        ("[::]:9000", "::", 9000, True),
        ("localhost:0", "localhost", 0, False),
    ],
)
def test_addresses(text, host, port, network):
    address = ServerAddress.parsed(text)
    assert (address.host, address.port) == (host, port)
    assert address.is_on_network == network


@pytest.mark.parametrize(
    ("host", "shown"), [("0.0.0.0", socket.gethostname()), ("127.0.0.1", "127.0.0.1")]
)
def test_others_are_told_an_address_that_they_can_reach(host, shown):
    with FoxgloveStream() as stream:
        server = stream.serve(ServerAddress(host, 0))
        assert server.url == f"ws://{shown}:{server.address.port}"


@pytest.mark.parametrize(
    "text",
    ["host:", "host:many", "127.0.0.1:70000", "1.2.3.4:-1", ":", "[robot]:1", "[::1", "a:b:1"],
)
def test_no_addresses(text):
    with pytest.raises(InvalidInputError, match="an address is HOST:PORT"):
        ServerAddress.parsed(text)
