"""How many times longer a program may take than in a build without a sanitizer, as tests/slowness.h says to C++."""
import os

SLOWNESS = 8 if {"ASAN_OPTIONS", "TSAN_OPTIONS"} & os.environ.keys() else 1
