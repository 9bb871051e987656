"""Identify an object by pushing it, and find the physics that a simulation leaves out. Built on Drake."""

import sys

if sys.argv[:1] == ["-m"]:  # so it is while Python looks for the module that it was told to run
    from physid_drake.process_start import begin

    begin()

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from physid_drake.model import Model
    from physid_drake.model_reading import load_model

__all__ = ["Model", "load_model"]


def __getattr__(name: str) -> Any:
    # Drake takes a second to import, which those who only read recordings need not wait for.
    if name in __all__:
        from physid_drake import model_reading  # noqa: PLC0415

        return getattr(model_reading, name)
    raise AttributeError(f"module 'physid_drake' has no attribute '{name}'")
