# SPDX-License-Identifier: Apache-2.0
import os

os.environ.setdefault("ABSENC_CHANGES", "none")  # tests leave nothing in the journal of who runs them

pytest_plugins = ["absenc.pytest_plugin"]
