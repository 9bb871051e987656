"""Diagnosis: where simulation and recording differ, and which physics is missing in the simulation."""

from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.exported import model_of
from physid_drake.diagnose.pipeline import diagnose, diagnose_from
from physid_drake.diagnose.system import DiagnosisSystem, Examined
from physid_drake.diagnose.values import Diagnosis
from physid_drake.pushes.case import Case, case_of, cell_config

__all__ = [
    "Case",
    "Diagnosis",
    "DiagnosisSystem",
    "Evidence",
    "Examined",
    "case_of",
    "cell_config",
    "diagnose",
    "diagnose_from",
    "model_of",
]
