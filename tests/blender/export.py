"""Tests of the Blender exporter: a scene for each feature, and the numbers in the files that it writes.

    python3 tests/blender/export.py FOLDER     (a Python with the module bpy; files are left in FOLDER)
"""

import os
import sys
import unittest

if __name__ == "__main__":
    here = os.path.dirname(os.path.abspath(__file__))
    sys.path.insert(0, here)
    os.environ["TWEENRAY_EXPORTS"] = os.path.abspath(sys.argv[1])
    tests = unittest.defaultTestLoader.discover(here, "test_*.py")
    found = unittest.TextTestRunner().run(tests)
    sys.exit(0 if found.wasSuccessful() and found.testsRun > 20 else 1)
