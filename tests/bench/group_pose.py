"""Poses: how the object was turned over, more than two of them, the rest that is suggested next, and fixtures."""
import pose_campaign
import pose_fixture
import pose_guided_flip
import pose_many
import pose_symmetric

PARTS = {"campaign": pose_campaign.measure, "symmetric": pose_symmetric.measure,
         "guided_flip": pose_guided_flip.measure, "poses": pose_many.measure,
         "fixture": pose_fixture.measure}
