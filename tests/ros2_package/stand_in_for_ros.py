"""What `planegrasp_ros` uses of rclpy, in one process, for machines without ROS.

Messages check their members as those that rosidl generates do (types, ranges left out), since that
is where a conversion can go wrong. Everything published is delivered at once.
"""

from __future__ import annotations

import array
import enum
import sys
import threading
import types
from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from rosbags.interfaces import Nodetype

_NAMES = {"float32": "float", "float64": "double", "byte": "octet"}


def install(store):
    """Make modules of these names importable, with the message types of a store."""
    modules = {name: types.ModuleType(name) for name in _MODULES}
    modules["rclpy.qos"].__dict__.update(_QOS)
    modules["rclpy.executors"].__dict__.update(
        ExternalShutdownException=type("ExternalShutdownException", (Exception,), {}),
        SingleThreadedExecutor=Executor,
    )
    modules["rclpy.signals"].SignalHandlerOptions = enum.Enum("SignalHandlerOptions", "NO ALL")
    modules["rosidl_runtime_py.utilities"].get_message = message_classes(store)
    modules["rclpy"].__dict__.update(
        init=lambda **options: None, create_node=Node, try_shutdown=lambda: None
    )
    sys.modules.update(modules)


_MODULES = (
    "rclpy",
    "rclpy.node",
    "rclpy.qos",
    "rclpy.executors",
    "rclpy.signals",
    "rosidl_runtime_py",
    "rosidl_runtime_py.utilities",
)


class _Policy(enum.Enum):
    KEEP_LAST = 1
    RELIABLE = 2
    BEST_EFFORT = 3
    TRANSIENT_LOCAL = 4
    VOLATILE = 5


@dataclass
class QoSProfile:
    depth: int
    history: _Policy
    reliability: _Policy
    durability: _Policy


_QOS = {
    "QoSProfile": QoSProfile,
    "HistoryPolicy": _Policy,
    "ReliabilityPolicy": _Policy,
    "DurabilityPolicy": _Policy,
}


def message_classes(store):
    """`get_message` of rosidl_runtime_py."""

    @cache
    def get_message(name):
        fields = {field: kind for field, kind in store.fielddefs[name][1] if field.islower()}

        class Message:
            def __init__(self, **given):
                assert set(given) == set(fields), f"{name} has {set(fields)}, not {set(given)}"
                for field, value in given.items():
                    _check(value, fields[field], get_message, f"{name}.{field}")
                    setattr(self, field, value)

            @classmethod
            def get_fields_and_field_types(cls):
                return {field: _described(kind) for field, kind in fields.items()}

        Message.__name__ = name
        return Message

    return get_message


def _described(kind):
    node, inner = kind
    if node is Nodetype.BASE:
        return _NAMES.get(inner[0], inner[0])
    if node is Nodetype.NAME:
        package, _, name = inner.split("/")
        return f"{package}/{name}"
    element, count = inner
    if node is Nodetype.SEQUENCE:
        return f"sequence<{_described(element)}>"
    return f"{_described(element)}[{count}]"


def _check(value, kind, get_message, where):
    node, inner = kind
    if node is Nodetype.NAME:
        assert isinstance(value, get_message(inner)), where
    elif node is Nodetype.BASE:
        name = inner[0]
        kinds = {"string": str, "bool": bool, "byte": bytes}
        wanted = kinds.get(name, float if "float" in name else int)
        assert type(value) is wanted, f"{where} is a {name}, got {value!r}"
    elif node is Nodetype.ARRAY:
        (_, (name, _)), count = inner
        assert isinstance(value, np.ndarray), where
        assert (value.dtype, value.size) == (np.dtype(name), count), where
    elif inner[0][0] is Nodetype.BASE and inner[0][1][0] != "string":
        code = {"uint8": "B", "float64": "d"}[inner[0][1][0]]
        assert isinstance(value, array.array), f"{where} must be an array.array"
        assert value.typecode == code, where
    else:
        assert isinstance(value, list), where
        for element in value:
            _check(element, inner[0], get_message, where)


@dataclass
class _Info:
    node_name: str
    node_namespace: str
    qos_profile: QoSProfile


@dataclass
class _Publisher:
    node: Node
    topic: str
    kind: str
    qos: QoSProfile

    def publish(self, message):
        assert type(message).__name__ == self.kind
        for callback in list(_SUBSCRIPTIONS[self.topic]):
            callback(message)

    def get_subscription_count(self):
        return len(_SUBSCRIPTIONS[self.topic])


_PUBLISHERS: list[_Publisher] = []
_SUBSCRIPTIONS = defaultdict(list)


class Node:
    """rclpy.node.Node, as far as it is used."""

    parameters: ClassVar[dict] = {}

    def __init__(self, name):
        self._name = name
        self.logged = []

    def get_name(self):
        return self._name

    def get_namespace(self):
        return "/"

    def get_logger(self):
        say = self.logged.append
        return types.SimpleNamespace(info=say, warning=say, error=say)

    def declare_parameter(self, name, default):
        value = self.parameters.get(name, default)
        assert type(value) is type(default), name
        return types.SimpleNamespace(value=value)

    def create_publisher(self, kind, topic, qos):
        publisher = _Publisher(self, topic, kind.__name__, qos)
        _PUBLISHERS.append(publisher)
        return publisher

    def destroy_publisher(self, publisher):
        _PUBLISHERS.remove(publisher)

    def create_subscription(self, kind, topic, callback, qos):
        _SUBSCRIPTIONS[topic].append(callback)
        return topic, callback

    def destroy_subscription(self, subscription):
        topic, callback = subscription
        _SUBSCRIPTIONS[topic].remove(callback)

    def count_publishers(self, topic):
        return sum(one.topic == topic for one in _PUBLISHERS)

    def get_topic_names_and_types(self):
        return [(one.topic, [one.kind]) for one in _PUBLISHERS]

    def get_publishers_info_by_topic(self, topic):
        return [
            _Info(one.node.get_name(), one.node.get_namespace(), one.qos)
            for one in _PUBLISHERS
            if one.topic == topic
        ]

    def destroy_node(self):
        pass


class Executor:
    """Nothing needs to be spun here."""

    def __init__(self):
        self._stop = threading.Event()

    def add_node(self, node):
        pass

    def spin(self):
        self._stop.wait()

    def shutdown(self):
        self._stop.set()
