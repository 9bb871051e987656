"""Families of pushes whose settings are a parameter space, and the files that a controller plays."""

from physid_drake.policies.planned_push import PlannedPush as PlannedPush
from physid_drake.policies.playback import HandSamples as HandSamples
from physid_drake.policies.playback import hand_samples as hand_samples
from physid_drake.policies.playback import push_csv as push_csv
from physid_drake.policies.policy import POLICIES as POLICIES
from physid_drake.policies.policy import Policy as Policy
from physid_drake.policies.policy import policy_named as policy_named
