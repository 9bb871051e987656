"""The first story: theta from recorded pushes."""

from physid_drake.identify.config import SearchConfig as SearchConfig
from physid_drake.identify.config import ThetaConfig as ThetaConfig
from physid_drake.identify.identify import Accuracy as Accuracy
from physid_drake.identify.identify import Estimate as Estimate
from physid_drake.identify.identify import Identification as Identification
from physid_drake.identify.identify import Identifier as Identifier
