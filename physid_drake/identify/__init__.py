"""Identification: the parameters theta of the baseline model, from recorded pushes."""

from physid_drake.identify.accuracy import Accuracy as Accuracy
from physid_drake.identify.cells import Combination as Combination
from physid_drake.identify.cells import IdentifiableCells as IdentifiableCells
from physid_drake.identify.config import SearchConfig as SearchConfig
from physid_drake.identify.estimates import Estimate as Estimate
from physid_drake.identify.identify import Identification as Identification
from physid_drake.identify.identify import Identifier as Identifier
from physid_drake.identify.identify import identified as identified
from physid_drake.identify.identify import identified_with as identified_with
from physid_drake.identify.identify import in_the_cell as in_the_cell
from physid_drake.identify.identify import with_prior as with_prior
from physid_drake.identify.online import OnlineBelief as OnlineBelief
from physid_drake.identify.online import OnlineIdentifier as OnlineIdentifier
from physid_drake.pushes.config import ThetaConfig as ThetaConfig
