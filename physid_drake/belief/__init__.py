"""What is thought about a function over a parameter space, given the trials so far."""

from physid_drake.belief.belief import Belief, BeliefSettings
from physid_drake.belief.gaussian_process import GaussianProcess, Hyperparameters
from physid_drake.belief.p_min import entropy, estimate_p_min

__all__ = ["Belief", "BeliefSettings", "GaussianProcess", "Hyperparameters", "entropy", "estimate_p_min"]
