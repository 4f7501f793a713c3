"""Factor by which a program may take longer than in a build without a sanitizer, as in tests/slowness.h for C++."""
import os

SLOWNESS = 8 if {"ASAN_OPTIONS", "TSAN_OPTIONS"} & os.environ.keys() else 1
