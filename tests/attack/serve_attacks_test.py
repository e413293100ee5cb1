"""Attacks on `touchstone serve` with plain sockets: serve_attacks_test.py PROGRAM SOURCE [CLASS]."""

import array
import contextlib
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PROGRAM = ""
SOURCE = pathlib.Path()
PATIENCE_S = 120  # ours; a server that hangs fails the test
MB = 1024 * 1024
HEAD = "Host: 127.0.0.1\r\n"

EVENT_SCENE = """device: events-device.yaml
object: probe.yaml
motion: beads-motion.yaml
light: {min_samples: 4, max_samples: 4}
outputs: {frames: true, events: true}
"""


@contextlib.contextmanager
def small_jobs():
    """A folder with tests/jobs in jobs/, and there a scene with events and a device with a large camera."""
    with tempfile.TemporaryDirectory(prefix="touchstone-serve-") as name:
        jobs = pathlib.Path(name) / "jobs"
        shutil.copytree(SOURCE / "tests/jobs", jobs)
        device = (jobs / "beads-device.yaml").read_text()
        events = "camera: {events: {dark_e_per_s: 1000, on_threshold: 0.15, off_threshold: 0.15}, "
        (jobs / "events-device.yaml").write_text(device.replace("camera: {", events, 1))
        (jobs / "events-scene.yaml").write_text(EVENT_SCENE)
        large = (jobs / "coated-device.yaml").read_text()
        for small, instead in [("width: 80", "width: 640"), ("height: 60", "height: 480"), ("_um: 22", "_um: 2.75")]:
            large = large.replace(small, instead)
        (jobs / "large-device.yaml").write_text(large)
        yield pathlib.Path(name)


class Server:
    """The program at any free port, from start to SIGTERM."""

    def __init__(self, folder, what, *options):
        command = [PROGRAM, "--quiet", "--cache", folder / "cache", "serve", folder / "jobs" / what, "--port", "0", *options]
        # A build with AddressSanitizer keeps 256 MB of freed memory otherwise.
        environment = {**os.environ, "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":quarantine_size_mb=8"}
        self.process = subprocess.Popen(
            [str(word) for word in command], stdout=subprocess.PIPE, encoding="utf-8", env=environment
        )
        said = ""
        while "Ctrl-C stops" not in said:
            line = self.process.stdout.readline()
            if not line:
                raise RuntimeError(f"the server ended: {said}")
            said += line
        self.port = int(re.search(r"frames: http://127\.0\.0\.1:(\d+)", said).group(1))
        events = re.search(r"events: tcp://127\.0\.0\.1:(\d+)", said)
        self.events_port = int(events.group(1)) if events else None

    def connect(self, port=None):
        return socket.create_connection(("127.0.0.1", port or self.port), timeout=PATIENCE_S)

    def answer(self, request):
        """Status, head and body of what comes for these bytes; status 0 if nothing does."""
        with self.connect() as to:
            with contextlib.suppress(ConnectionError):
                to.sendall(request if isinstance(request, bytes) else request.encode())
            return self.read(to)

    @staticmethod
    def read(to):
        everything = b""
        with contextlib.suppress(ConnectionError):
            while part := to.recv(65536):
                everything += part
        head, _, body = everything.partition(b"\r\n\r\n")
        status = re.match(rb"HTTP/1\.1 (\d+)", head)
        return int(status.group(1)) if status else 0, head.decode("latin-1"), body

    def ask(self, line, head=HEAD, body=""):
        """An ordinary request that ends its connection."""
        form = "Content-Type: application/x-www-form-urlencoded\r\n" if body else ""
        length = f"Content-Length: {len(body)}\r\n"
        return self.answer(f"{line} HTTP/1.1\r\n{head}{form}{length}Connection: close\r\n\r\n{body}")

    def memory(self, what="VmHWM"):
        """The process' bytes; VmHWM: the most so far."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return 1024 * int(re.search(rf"{what}:\s+(\d+) kB", status).group(1))

    def stop(self):
        self.process.terminate()
        code = self.process.wait(timeout=PATIENCE_S)
        self.process.stdout.close()
        return code


class Attack(unittest.TestCase):
    WHAT = "coated-device.yaml"
    OPTIONS = ()

    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(small_jobs())
        cls.server = Server(folder, cls.WHAT, *cls.OPTIONS)
        cls.addClassCleanup(cls.server.process.kill)

    def setUp(self):
        self.addCleanup(lambda: self.assertEqual(self.server.ask("GET /status.json")[0], 200, "it still answers"))

    @classmethod
    def tearDownClass(cls):
        code = cls.server.stop()
        if code != 0:
            raise RuntimeError(f"the server ended with {code}")

    def keep_open(self, connection):
        self.addCleanup(connection.close)
        return connection

    def expect(self, answer, status, *parts):
        """Status, and a sentence of JSON that has all parts."""
        self.assertEqual(answer[0], status, answer)
        self.assertIn("application/json", answer[1])
        for part in parts:
            self.assertIn(part, json.loads(answer[2])["error"])


class SlowRequests(Attack):
    OPTIONS = ("--patience", "2")

    def test_slow_heads_and_bodies_hold_nobody_and_are_ended(self):
        # More than there are workers. Each sends a byte now and then, so no wait for a single byte ever ends.
        ended = threading.Event()
        starts = [b"GET /frame.jpg HTTP/1.1\r\nX-Slow: ", b"POST /press HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4000\r\n\r\n"]
        slow = [self.keep_open(self.server.connect()) for _ in range(80)]
        for i, connection in enumerate(slow):
            connection.sendall(starts[i % 2])

        def drip():
            while not ended.wait(0.2):
                for connection in slow:
                    with contextlib.suppress(OSError):
                        connection.send(b"a")

        dripping = threading.Thread(target=drip)
        dripping.start()
        try:
            self.assertEqual(self.server.ask("GET /status.json")[0], 200)
            self.assertEqual([True] * 80, [self.is_open(one) for one in slow], "answered while all of them are there")
            for connection in slow:
                self.expect(Server.read(connection), 408, "isn't there as a whole after 2 s")
        finally:
            ended.set()
            dripping.join()

    def test_many_silent_connections_make_room_for_who_comes(self):
        for _ in range(400):
            self.keep_open(self.server.connect())
        self.assertEqual(self.server.ask("GET /status.json")[0], 200)

    @staticmethod
    def is_open(connection):
        connection.setblocking(False)
        try:
            connection.recv(1, socket.MSG_PEEK)
            return False  # an answer, or the end
        except BlockingIOError:
            return True
        except OSError:
            return False
        finally:
            connection.settimeout(PATIENCE_S)


class Ranges(Attack):
    def test_the_same_bytes_are_sent_once(self):
        whole = len(self.server.ask("GET /frame.jpg")[2])
        ranges = ",".join(["0-"] * 2600)
        before = self.server.memory()
        for _ in range(6):
            status, head, body = self.server.ask("GET /frame.jpg", HEAD + f"Range: bytes={ranges}\r\n")
            self.assertEqual(status, 200, "a range is left out, the answer is whole")
            self.assertNotIn("multipart", head)
            self.assertLess(len(body), 2 * whole)
        self.assertLess(self.server.memory() - before, 50 * MB)


class Bodies(Attack):
    def test_large_ones_are_refused_before_they_come(self):
        before = self.server.memory()
        types = ["application/x-www-form-urlencoded", "text/plain", "application/octet-stream", "multipart/form-data; boundary=b"]
        part = b"--b\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\n" + b"a" * 8 * MB
        # As many as have room for a while: each is answered although its body goes on coming.
        for i in range(20):
            head = f"POST /press HTTP/1.1\r\n{HEAD}Content-Type: {types[i % 4]}\r\nContent-Length: 2000000000\r\n\r\n"
            connection = self.keep_open(self.server.connect())
            with contextlib.suppress(ConnectionError):
                connection.sendall(head.encode() + part)
            self.expect(Server.read(connection), 413, "2000000000", "8192")
        self.assertLess(self.server.memory() - before, 50 * MB)

    def test_chunked_ones_are_refused(self):
        head = f"POST /press HTTP/1.1\r\n{HEAD}Transfer-Encoding: chunked\r\n\r\n40000000\r\n"
        self.expect(self.server.answer(head), 411, "Transfer-Encoding", "Content-Length")

    def test_lengths_that_are_none_are_refused(self):
        for length in ["-1", "1e3", "0x10", "", "5, 5", "7\r\nContent-Length: 8"]:
            self.expect(self.server.answer(f"POST /press HTTP/1.1\r\n{HEAD}Content-Length: {length}\r\n\r\n"), 400, "Content-Length")
        huge = "9" * 30
        self.expect(self.server.answer(f"POST /press HTTP/1.1\r\n{HEAD}Content-Length: {huge}\r\n\r\n"), 413, huge)

    def test_a_body_that_is_no_form_is_refused(self):
        head = HEAD + "Content-Type: application/json\r\n"
        self.expect(self.server.answer(f"POST /press HTTP/1.1\r\n{head}Content-Length: 2\r\n\r\n{{}}"), 415, "'application/json'",
                    "application/x-www-form-urlencoded")

    def test_heads_that_are_none_are_refused(self):
        self.expect(self.server.answer("GET / HTTP/1.1\r\n" + "X: y\r\n" * 4000), 431, "16384")
        self.expect(self.server.answer("GET / HTTP/1.1\r\nno colon\r\n\r\n"), 400, "'no colon'")
        self.expect(self.server.answer('GET / HTTP/1.1\r\n"quoted\\"\r\n\r\n'), 400, '\'"quoted\\"\'')
        self.expect(self.server.answer(b"GET / HTTP/1.1\r\n\xe4\xff\r\n\r\n"), 400, "'\ufffd\ufffd'")
        self.expect(self.server.answer("GET / HTTP/1.1\r\n folded: line\r\n\r\n"), 400, "Name: value")
        for letter in ["\0", "\n", "\r", "\x7f"]:
            self.expect(self.server.answer(f"GET / HTTP/1.1\r\nHost: 127.0.0.1{letter}Range: bytes=0-\r\n\r\n"), 400, "control character")
        self.expect(self.server.answer(b"\x16\x03\x01\x02\x00\x01"), 400, "starts with a method")
        self.expect(self.server.answer(f"GET / HTTP/9\r\n{HEAD}\r\n"), 400, "can't be read")
        self.expect(self.server.answer(f"GET /{'a' * 9000} HTTP/1.1\r\n{HEAD}\r\n"), 414, "can't be read")


class Presses(Attack):
    def test_a_flood_of_them_leaves_room_for_frames(self):
        request = f"POST /press?object=ball-8mm&force_N=0.2 HTTP/1.1\r\n{HEAD}\r\n".encode()
        flood = [self.keep_open(self.server.connect()) for _ in range(100)]
        for connection in flood:
            connection.sendall(request)
        self.assertEqual(self.server.ask("GET /frame.jpg")[0], 200)
        answers = [Server.read(connection) for connection in flood]
        self.assertEqual({answer[0] for answer in answers}, {200, 503})
        busy = next(answer for answer in answers if answer[0] == 503)
        self.expect(busy, 503, "8 commands are being carried out")

    def test_streams_that_nobody_reads_leave_room(self):
        watching = []
        for _ in range(60):
            watching.append(self.keep_open(self.server.connect()))
            watching[-1].sendall(f"GET /stream.mjpg HTTP/1.1\r\n{HEAD}\r\n".encode())
        firsts = [connection.recv(12) for connection in watching]
        self.assertEqual(firsts.count(b"HTTP/1.1 200"), 24)
        self.assertEqual(firsts.count(b"HTTP/1.1 503"), 36)
        self.assertEqual(self.server.ask("GET /frame.jpg")[0], 200)


class PressesOfLargePictures(Attack):
    WHAT = "large-device.yaml"

    def test_what_earlier_ones_showed_is_let_go(self):
        def press(number):
            for _ in range(number):
                self.assertEqual(self.server.ask("POST /press", body="force_N=0.2")[0], 200)

        press(5)
        before = self.server.memory("VmRSS")
        press(30)  # a picture's light is 4 MB
        self.assertLess(self.server.memory("VmRSS") - before, 70 * MB)


class Sources(Attack):
    OPTIONS = ("--host", "sensor.local", "--allow-origin", "http://lab.example:3000")

    def press(self, head):
        return self.server.ask("POST /press", head, "force_N=0.2")

    def test_a_foreign_page_does_not_press(self):
        for origin in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1.evil.example", "http://lab.example"]:
            self.expect(self.press(f"{HEAD}Origin: {origin}\r\n"), 403, f"'{origin}'", "--allow-origin")
        self.assertEqual(json.loads(self.server.ask("GET /status.json")[2])["force_N"][2], 0.0)

    def test_the_own_page_and_an_allowed_one_press(self):
        port = self.server.port
        self.assertEqual(self.press(f"Host: localhost:{port}\r\nOrigin: http://localhost:{port}\r\n")[0], 200)
        status, head, _ = self.press(f"{HEAD}Origin: http://lab.example:3000\r\n")
        self.assertEqual(status, 200)
        self.assertIn("Access-Control-Allow-Origin: http://lab.example:3000", head)

    def test_a_foreign_name_is_not_answered(self):
        hosts = ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "localhost.evil.example", "127.1", "2130706433",
                 "[::1", "127.0.0.1:80:80", "127.0.0.1@evil.example", "sensor.local.", ""]
        for host in hosts:
            self.expect(self.server.ask("GET /status.json", f"Host: {host}\r\n"), 421, f"'{host}'", "--host")
        self.expect(self.server.ask("GET /status.json", ""), 421, "Host: ''")
        self.expect(self.server.ask("GET /status.json", HEAD + "Host: evil.example\r\n"), 400, "once")

    def test_addresses_and_given_names_are(self):
        for host in ["127.0.0.1", "192.168.1.7:8080", "[::1]:80", "LocalHost", "localhost:1", "Sensor.Local:8080"]:
            self.assertEqual(self.server.ask("GET /status.json", f"Host: {host}\r\n")[0], 200, host)


class Words(Attack):
    """Mistakes that are answered with what is wanted."""

    def test_a_wrong_method_is_answered_by_the_right_one(self):
        answer = self.server.ask("GET /press")
        self.expect(answer, 405, "/press wants POST, not GET", "force_N=1")
        self.assertIn("Allow: POST", answer[1])
        answer = self.server.ask("POST /frame.jpg")
        self.expect(answer, 405, "wants GET")
        self.assertIn("Allow: GET, HEAD", answer[1])
        self.expect(self.server.ask("OPTIONS /press"), 405, "wants POST")
        self.expect(self.server.ask("GET /frames"), 404, "there is no /frames", "/frame.jpg", "/press")

    def test_a_press_without_values_is_answered_by_an_example_that_works(self):
        answer = self.server.ask("POST /press")
        self.expect(answer, 400, "nothing is asked for")
        example = json.loads(answer[2])["error"].split()[-1]
        self.assertEqual(self.server.ask("POST /press", body=example)[0], 200, example)

    def test_a_post_without_a_length_has_no_body(self):
        self.assertEqual(self.server.answer(f"POST /release HTTP/1.1\r\n{HEAD}\r\n")[0], 200)


class EventReaders(Attack):
    WHAT = "events-scene.yaml"
    OPTIONS = ("--patience", "5", "--rate", "1000")  # half a minute of events in a second

    def test_who_does_not_read_makes_room(self):
        for _ in range(64):
            self.reader()
        deadline = time.monotonic() + PATIENCE_S
        while (first := self.first_bytes()).startswith(b"% error"):
            self.assertLess(time.monotonic(), deadline, "none of those who don't read has been ended")
            time.sleep(0.1)
        self.assertTrue(first.startswith(b"% evt 3.0"), first)

    def test_who_comes_back_late_misses_events_and_can_see_it(self):
        before = self.server.memory()
        late = [self.reader() for _ in range(40)]
        time.sleep(4)  # behind by more than 2 s, but not by the patience of 5
        got = bytearray()
        deadline = time.monotonic() + PATIENCE_S
        while not self.has_gap(got):
            self.assertLess(self.server.memory() - before, 200 * MB)
            self.assertLess(time.monotonic(), deadline, f"no gap in {len(got)} bytes")
            parts = [connection.recv(MB) for connection in late]
            self.assertTrue(parts[0], "ended")
            got += parts[0]

    @staticmethod
    def has_gap(stream):
        """Whether the time jumps by more than 4 s, where it otherwise steps by 5 ms of the server's time (0.2 s)."""
        words = array.array("H", (body := stream.partition(b"% end\n")[2])[: len(body) // 2 * 2])
        highs = [word & 0xFFF for word in words if word >> 12 == 0x8]
        return any((b - a) % 4096 > 1000 for a, b in zip(highs, highs[1:]))

    def test_when_all_places_are_of_readers_a_further_one_is_told(self):
        readers = [self.reader() for _ in range(64)]
        ended = threading.Event()

        def read_all():
            while not ended.is_set():
                for connection in readers:
                    connection.setblocking(False)
                    with contextlib.suppress(OSError):
                        connection.recv(MB)

        reading = threading.Thread(target=read_all)
        reading.start()
        try:
            time.sleep(0.5)
            self.assertEqual(self.first_bytes(1000), b"% error 64 clients are served; no more are\n% end\n")
        finally:
            ended.set()
            reading.join()

    def reader(self):
        """A client that has a place; those of an earlier test may still be taken."""
        deadline = time.monotonic() + PATIENCE_S
        while True:
            connection = self.keep_open(self.server.connect(self.server.events_port))
            if connection.recv(10).startswith(b"% evt 3.0"):
                return connection
            self.assertLess(time.monotonic(), deadline, "no place")

    def first_bytes(self, most=10):
        with self.server.connect(self.server.events_port) as to:
            got = b""
            while len(got) < most and (part := to.recv(most - len(got))):
                got += part
            return got


if __name__ == "__main__":
    PROGRAM, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
