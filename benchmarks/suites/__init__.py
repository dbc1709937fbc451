"""The suites of `paravol bench`: each lists and makes its measurements."""

from benchmarks.suites.anatomy import AnatomyPlan
from benchmarks.suites.art import ArtPlan
from benchmarks.suites.art_bent import BentPlan
from benchmarks.suites.art_classification import ClassificationPlan
from benchmarks.suites.art_dataflow import DataflowPlan
from benchmarks.suites.art_growth import GrowthPlan
from benchmarks.suites.art_ranks import RealRanksPlan
from benchmarks.suites.art_scaling import ScalingPlan
from benchmarks.suites.flight import FlightPlan
from benchmarks.suites.fsr import FsrPlan
from benchmarks.suites.fsr_growth import FsrGrowthPlan
from benchmarks.suites.haptics import HapticsPlan
from benchmarks.suites.jobs import JobsPlan
from benchmarks.suites.light import LightPlan
from benchmarks.suites.look import LookPlan
from benchmarks.suites.refinement import RefinementPlan
from benchmarks.suites.scoring import ScoringPlan
from benchmarks.suites.skipping import SkippingPlan
from benchmarks.suites.splats import SplatsPlan
from benchmarks.suites.startup import StartupPlan
from benchmarks.suites.surgery import SurgeryPlan
from benchmarks.suites.takeover import TakeoverPlan
from benchmarks.suites.visibility import VisibilityPlan
from benchmarks.suites.window import WindowPlan

__all__ = [
    "AnatomyPlan",
    "ArtPlan",
    "BentPlan",
    "ClassificationPlan",
    "DataflowPlan",
    "FlightPlan",
    "FsrGrowthPlan",
    "FsrPlan",
    "GrowthPlan",
    "HapticsPlan",
    "JobsPlan",
    "LightPlan",
    "LookPlan",
    "RealRanksPlan",
    "RefinementPlan",
    "ScalingPlan",
    "ScoringPlan",
    "SkippingPlan",
    "SplatsPlan",
    "StartupPlan",
    "SurgeryPlan",
    "TakeoverPlan",
    "VisibilityPlan",
    "WindowPlan",
]
