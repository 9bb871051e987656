"""A model for plants and simulators of one's own: SDFormat with model directives for Drake, and MJCF for MuJoCo."""

from physid_drake.export.files import exported as exported
