"""Poses: the rest that is suggested for the next one."""
import pose_guided_flip

PARTS = {"guided_flip": pose_guided_flip.measure}
