# SPDX-License-Identifier: Apache-2.0
import os

os.environ.setdefault("ABSENC_CHANGES", "none")  # tests write nothing to the user's journal of changes

pytest_plugins = ["absenc.pytest_plugin"]
