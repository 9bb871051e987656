"""The first story: theta from recorded pushes."""

from physid_drake.identify.cells import CellsTold as CellsTold
from physid_drake.identify.cells import Combination as Combination
from physid_drake.identify.config import SearchConfig as SearchConfig
from physid_drake.identify.identify import Accuracy as Accuracy
from physid_drake.identify.identify import Estimate as Estimate
from physid_drake.identify.identify import Identification as Identification
from physid_drake.identify.identify import Identifier as Identifier
from physid_drake.identify.online import OnlineBelief as OnlineBelief
from physid_drake.identify.online import OnlineIdentifier as OnlineIdentifier
from physid_drake.pushes.config import ThetaConfig as ThetaConfig
