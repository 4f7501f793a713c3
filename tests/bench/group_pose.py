"""Poses: the rest that is suggested for the next one, and more than two of them."""
import pose_guided_flip
import pose_many

PARTS = {"guided_flip": pose_guided_flip.measure, "poses": pose_many.measure}
