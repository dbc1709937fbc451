"""OpenIGTLink: tool poses to and from navigation software such as 3D Slicer."""

from devices.openigtlink.igtl_source import OpenIGTLinkSource
from devices.openigtlink.messages import ToolTransform, TransformReader, encode
from devices.openigtlink.streamer import PoseStreamer

__all__ = [
    "OpenIGTLinkSource",
    "PoseStreamer",
    "ToolTransform",
    "TransformReader",
    "encode",
]
