"""The data doctor: where pushes fit nothing, whether their conventions are other than what is said."""

from physid_drake.doctor.examination import Finding, examined

__all__ = ["Finding", "examined"]
