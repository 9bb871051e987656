"""The world: a Drake diagram of table, object and hand, and rollouts of it."""

from physid_drake.cell.cell import Cell as Cell
from physid_drake.cell.config import CellConfig as CellConfig
from physid_drake.cell.config import ContactConfig as ContactConfig
from physid_drake.cell.config import SolverConfig as SolverConfig
from physid_drake.cell.hand_path import HandPath as HandPath
from physid_drake.cell.motion import Motion as Motion
from physid_drake.cell.motion import Outcome as Outcome
from physid_drake.cell.motion import Start as Start
from physid_drake.cell.setters import Body as Body
