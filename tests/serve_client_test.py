# SPDX-License-Identifier: Apache-2.0
"""Tests openapi.json with a TypeScript client that is generated from it."""
import json
import os
import re
import shutil
import subprocess
import unittest

from command_support import PATIENCE
from npm_support import MODULES, SOURCE, tool
from serve_support import TOKEN, ServeCase, of, wait_until

NAME = "sim:tformat?motion=rpm=60&alarm=over_heat"
OPTIONS = {"strict": True, "module": "nodenext", "target": "es2022", "lib": ["es2022", "dom", "dom.iterable"], "skipLibCheck": True}


class Client(ServeCase):
    def run_tool(self, *command):
        return subprocess.run(command, cwd=self.directory, capture_output=True, text=True, timeout=4 * PATIENCE, check=False)

    def generate(self):
        """Generates the TypeScript types of the API with openapi-typescript."""
        generator = tool("openapi-typescript/bin/cli.js")
        os.symlink(MODULES, os.path.join(self.directory, "node_modules"))
        self.file("package.json", '{"type": "module"}')
        done = self.run_tool("node", str(generator), str(SOURCE / "absenc/serve/page/openapi.json"), "--output", "api.d.ts")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def compile(self, name):
        self.file("tsconfig.json", json.dumps({"compilerOptions": OPTIONS, "files": [name]}))
        return self.run_tool("node", str(tool("typescript/bin/tsc")), "--project", "tsconfig.json")

    def test_generated_client_finds_all_routes(self):
        self.generate()
        shutil.copy(SOURCE / "tests/npm/client.ts", self.directory)
        done = self.compile("client.ts")
        self.assertEqual(done.returncode, 0, done.stdout)
        server = self.server(NAME, "--history", self.file("history"), "--token-file", self.tokens())
        wait_until(lambda: server.json(of(NAME, "history"))["rows"], "it has a second")
        wait_until(lambda: server.json(of(NAME))["reply"], "it has a reply")
        done = self.run_tool("node", "client.js", server.url.rstrip("/"), NAME, TOKEN)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads(done.stdout)
        self.assertEqual((found["state"], found["alarm"], found["minute"]), ("live", "over_heat", NAME))
        self.assertEqual((found["who"], found["acknowledged"], found["mqtt"]), ("anna", "anna", None))
        self.assertIn("set-overheat-threshold", found["commands"])
        self.assertIn("alarm", found["kinds"])
        self.assertIn(["overheat_threshold_c", "90 degC"], found["setting"])
        self.assertEqual((found["stream"], found["unknown"], found["ok"], found["has_metrics"]), (200, 404, True, True))
        # The result of doctor is not ok, because the encoder has an alarm.
        self.assertEqual((found["bytes"], found["doctor"]), (127, False))
        asked = set(re.findall(r'client\.\w+\("([^"]+)"', (SOURCE / "tests/npm/client.ts").read_text(encoding="utf-8")))
        described = set(server.json("/openapi.json")["paths"]) - {"/openapi.json", "/api/encoders/{encoder}/stream"}
        self.assertEqual(asked, described)

    def test_undescribed_routes_do_not_compile(self):
        self.generate()
        head = 'import createClient from "openapi-fetch";\nimport type {paths} from "./api.js";\nconst client = createClient<paths>();\n'
        for wrong in ('await client.GET("/api/history");', 'console.log((await client.GET("/api/encoders")).data?.encoders[0]?.angle);',
                      'await client.POST("/api/encoders/{encoder}/acknowledge", {params: {path: {encoder: "a"}}});'):
            self.file("wrong.ts", head + wrong)
            with self.subTest(wrong):
                done = self.compile("wrong.ts")
                self.assertNotEqual(done.returncode, 0)
                self.assertIn("wrong.ts(4,", done.stdout)


if __name__ == "__main__":
    unittest.main()
