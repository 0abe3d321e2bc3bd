# SPDX-License-Identifier: Apache-2.0
"""Tests the MQTT spool of `absenc serve` on a full disk, and when removed or damaged."""
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import unittest

from command_support import absenc, end
from mqtt_support import ONE, MqttCase, free_port, numbers, twice, waiting_in
from serve_support import wait_until

# Command that mounts a small file system, visible only to the started program and its children.
ON_DISK = ("unshare", "-Urm", "sh", "-c", 'mount -t tmpfs -o size=3m none "$0" && exec "$@"')


def has_disks():
    return subprocess.run([*ON_DISK, "/mnt", "true"], capture_output=True, check=False).returncode == 0


class SpoolCase(MqttCase):
    def numbers(self, receiver):
        return numbers(receiver.all("readings"), ONE)

    def last(self, receiver):
        return (self.numbers(receiver) or [0])[-1]

    def remove_spool(self):
        """Renames the spool folder first, because the server may create files in it."""
        os.rename(self.spool(), self.spool() + ".gone")
        shutil.rmtree(self.spool() + ".gone")

    def events(self, receiver):
        return [one["text"] for one in receiver.all("event")]

    def wait_for_event(self, receiver, words):
        wait_until(lambda: [one for one in self.events(receiver) if words in one], f"an event has: {words}")

    def away(self):
        """Returns a broker that is stopped and can be started later."""
        broker = self.broker()
        broker.kill()
        return broker


class FullDisk(SpoolCase):
    @unittest.skipUnless(has_disks(), "no user namespaces here")
    def test_spool_that_filled_its_disk_drains(self):
        broker = self.away()
        disk = os.path.join(self.directory, "disk")
        os.mkdir(disk)
        server = self.without_history(ONE, "--rate", "1000", "--mqtt", broker.url, "--mqtt-prefix", "plant/hall",
                                      "--mqtt-spool", os.path.join(disk, "spool"), "--mqtt-spool-mb", "100",
                                      within=(*ON_DISK, disk))
        wait_until(lambda: self.mqtt(server)["waiting"] > 50, "messages are spooled")
        seen = f"/proc/{server.process.pid}/root{disk}"
        with open(f"{seen}/others", "wb", buffering=0) as others, self.assertRaises(OSError):
            while True:
                others.write(bytes(65536))  # the test fills the disk, as another program would
        wait_until(lambda: "No space left" in self.mqtt(server)["trouble"], "it says that the disk is full")
        self.assertEqual(server.json("/healthz")["mqtt"], "failing")
        self.assertFalse(server.json("/healthz")["ok"])
        broker.start()
        receiver = self.receiver(broker)
        wait_until(lambda: not self.mqtt(server)["trouble"], "it has room again, although nobody else made any")
        goal = self.taken(server)
        wait_until(lambda: self.last(receiver) >= goal, "they come")
        found = self.numbers(receiver)
        self.assertEqual(found, list(range(1, len(found) + 1)))
        self.assertEqual(twice(receiver.all("readings")), 0)
        self.wait_for_event(receiver, "the spool cannot be written")
        self.wait_for_event(receiver, "can be written again")
        self.assertTrue(os.path.exists(f"{seen}/others"))

    def test_live_messages_continue_while_disk_is_full(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        server = self.sender(broker.url, ONE, preexec_fn=lambda: signal.signal(signal.SIGXFSZ, signal.SIG_IGN))
        wait_until(lambda: self.last(receiver) > 20, "readings are spooled, and sent")
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        wait_until(lambda: "the spool" in self.mqtt(server)["trouble"], "it says so")
        goal = self.last(receiver) + 100
        wait_until(lambda: self.last(receiver) > goal, "they come all the same")
        found = self.numbers(receiver)
        self.assertEqual(found, list(range(1, len(found) + 1)))
        self.assertEqual(server.json("/healthz")["mqtt"], "failing")
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        wait_until(lambda: server.json("/healthz")["ok"], "it is well again")
        self.assertEqual(self.mqtt(server)["dropped"], 0)

    def test_drops_are_reported_everywhere(self):
        broker = self.away()
        server = self.sender(broker.url, ONE, "--mqtt-spool-mb", "1", "--rate", "0")
        stream = self.stream(server)
        wait_until(lambda: self.mqtt(server)["dropped"], "the oldest are dropped")
        health = server.json("/healthz")
        self.assertEqual((health["ok"], health["mqtt"]), (False, "failing"))
        self.assertGreater(health["mqtt_dropped"], 0)
        stream.until(lambda event, data: event == "happening" and "were dropped" in data["text"])
        broker.start()
        self.wait_for_event(self.receiver(broker), "were dropped")


class Damage(SpoolCase):
    def test_removed_spool_is_created_again(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        server = self.sender(broker.url, ONE)
        wait_until(lambda: self.numbers(receiver), "readings come")
        self.remove_spool()
        self.wait_for_event(receiver, "was removed")
        wait_until(lambda: os.path.isdir(self.spool()), "it is there again")
        goal = self.taken(server) + 50
        wait_until(lambda: self.last(receiver) > goal, "readings go on")
        found = self.numbers(receiver)
        self.assertEqual(found, list(range(1, len(found) + 1)), "what the open file had is sent from memory")
        self.assertEqual(self.mqtt(server)["dropped"], 0)

    def test_removed_messages_are_counted(self):
        broker = self.away()
        server = self.sender(broker.url, ONE, "--mqtt-spool-mb", "2", "--rate", "0")
        wait_until(lambda: len(os.listdir(self.spool())) > 3, "there are several files")
        self.remove_spool()
        wait_until(lambda: self.mqtt(server)["dropped"], "the loss is counted")
        broker.start()
        receiver = self.receiver(broker)
        self.wait_for_event(receiver, "was removed")
        found = wait_until(lambda: self.numbers(receiver), "the rest comes")
        self.assertGreater(found[0], 1)

    def test_moved_folder_can_be_moved_back(self):
        broker = self.away()
        server = self.sender(broker.url, ONE)
        wait_until(lambda: self.taken(server) > 50, "they are spooled")
        goal = self.taken(server)
        os.rename(self.spool(), self.spool() + ".moved")
        wait_until(lambda: os.path.exists(self.spool()), "it is made anew")
        wait_until(lambda: self.taken(server) > goal + 50, "it goes on")
        end(server.process, signal.SIGKILL)
        # Messages of events, which have no key `first`, may stand before the messages of readings.
        first = next(one["first"] for one in waiting_in(self.spool()) if "first" in one)
        self.assertEqual(first, 1, "what the open file had was written again")

    def test_garbage_file_in_place_of_spool_is_set_aside(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        pathlib.Path(self.spool()).write_bytes(b"SQLite format 3\0" + bytes(range(256)) * 10)
        self.sender(broker.url, ONE)
        wait_until(lambda: self.numbers(receiver), "readings come")
        self.wait_for_event(receiver, f"it was renamed to {self.spool()}.bad")
        self.assertEqual(pathlib.Path(self.spool() + ".bad").stat().st_size, 2576)

    def test_damaged_file_is_sent_up_to_damage_and_set_aside(self):
        broker = self.away()
        server = self.sender(broker.url, ONE, "--rate", "200")
        wait_until(lambda: self.mqtt(server)["waiting"] > 30, "they are spooled")
        end(server.process, signal.SIGKILL)
        path, = pathlib.Path(self.spool()).glob("*.part")
        first = waiting_in(self.spool())
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 0xFF
        path.write_bytes(data)
        broker.start()
        receiver = self.receiver(broker)
        server = self.sender(broker.url, ONE)
        self.wait_for_event(receiver, "cannot be read from byte")
        wait_until(lambda: path.with_suffix(".part.bad").exists(), "it is set aside")
        self.assertEqual(path.with_suffix(".part.bad").stat().st_size, len(data))
        found = wait_until(lambda: self.numbers(receiver), "readings come")
        self.assertEqual(found[:20], list(range(1, 21)))
        ids = [one["id"] for one in receiver.all("readings")]
        self.assertEqual(len(set(ids)), len(ids))
        self.assertNotIn(first[-1]["id"], ids, "it was behind the damage")

    def test_garbage_written_into_open_file(self):
        broker = self.away()
        server = self.sender(broker.url, ONE, "--mqtt-spool-mb", "1", "--rate", "1000")
        wait_until(lambda: len(os.listdir(self.spool())) > 2, "there are several files")
        oldest = min(pathlib.Path(self.spool()).glob("*.part"))
        with open(oldest, "r+b") as file:
            file.seek(10_000)
            file.write(b"garbage" * 100)
        broker.start()
        receiver = self.receiver(broker)
        wait_until(lambda: self.mqtt(server)["dropped"], "what cannot be read is counted")
        wait_until(lambda: oldest.with_suffix(".part.bad").exists(), "it is set aside")
        goal = self.taken(server)
        wait_until(lambda: self.last(receiver) >= goal, "the others come")
        found = self.numbers(receiver)
        self.assertEqual(found, sorted(set(found)))
        self.assertEqual(goal - len([one for one in found if one <= goal]), self.mqtt(server)["dropped"])


class Start(SpoolCase):
    def test_missing_parent_folder_is_refused(self):
        result = absenc("serve", ONE, "--listen", "127.0.0.1:0", "--history", "none", "--mqtt",
                        f"mqtt://127.0.0.1:{free_port()}", "--mqtt-spool", os.path.join(self.directory, "none/spool"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("none/spool", result.stderr)

    def test_disk_full_at_start(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        server = self.sender(broker.url, ONE, preexec_fn=limit)
        wait_until(lambda: len(self.numbers(receiver)) > 50, "readings come")
        self.assertIn("the spool", self.mqtt(server)["trouble"])
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        wait_until(lambda: not self.mqtt(server)["trouble"], "it is made later")
        found = self.numbers(receiver)
        self.assertEqual(found, list(range(1, len(found) + 1)))


if __name__ == "__main__":
    unittest.main()
