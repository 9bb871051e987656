"""Recordings: what was measured, how it is read and written, and what it says about its own noise."""

from physid_drake.recording.digest import digest_of
from physid_drake.recording.naming import recording_folder
from physid_drake.recording.object_model import Box, Cylinder, MeshShape, ObjectModel, Prism, Shape
from physid_drake.recording.outlines import convex_pieces, is_convex, outline_distance, polygon_centroid
from physid_drake.recording.planar import planar_poses
from physid_drake.recording.reading import read_recording
from physid_drake.recording.statistics import (
    NoiseEstimate,
    PushSummary,
    estimate_noise,
    motion_span,
    rest_segments,
    summarise,
)
from physid_drake.recording.thinning import thinned
from physid_drake.recording.values import Conversion, ForceStream, Hand, PoseStream, Push, Recording, Sensors, Table
from physid_drake.recording.writing import write_recording

__all__ = [
    "Box",
    "Conversion",
    "Cylinder",
    "ForceStream",
    "Hand",
    "MeshShape",
    "NoiseEstimate",
    "ObjectModel",
    "PoseStream",
    "Prism",
    "Push",
    "PushSummary",
    "Recording",
    "Sensors",
    "Shape",
    "Table",
    "convex_pieces",
    "digest_of",
    "estimate_noise",
    "is_convex",
    "motion_span",
    "outline_distance",
    "planar_poses",
    "polygon_centroid",
    "read_recording",
    "recording_folder",
    "rest_segments",
    "summarise",
    "thinned",
    "write_recording",
]
