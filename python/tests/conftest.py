# SPDX-License-Identifier: Apache-2.0
import os

os.environ.setdefault("ABSENC_CHANGES", "none")  # keeps the tests from writing to the user's journal of changes

pytest_plugins = ["absenc.pytest_plugin"]
