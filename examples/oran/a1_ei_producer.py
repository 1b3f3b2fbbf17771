#!/usr/bin/env python3
"""Makes a live run a producer of A1 enrichment information in an O-RAN network.

    umbracast live --site hall.toml --serve 127.0.0.1:8600
    python3 examples/oran/a1_ei_producer.py --live http://127.0.0.1:8600 \
        --coordinator http://ics:8083 --listen 0.0.0.0:8700 --public http://hall-gateway:8700

It registers one information type and itself at the information coordinator (the data producer's interface of O-RAN SC's
information coordinator service, /data-producer/v1). The coordinator then tells of every job that consumers ask for, a near-RT
RIC by A1-EI among them. What a job asks for is posted to the job's address: the links that are likely enough to be blocked, and
the decisions about devices. Python 3.10 and nothing else is needed.
"""

import argparse
import json
import os
import re
import sys
import threading
import time
import urllib.error
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

TYPE = "umbracast_blockage_1.0.0"
PRODUCER = "umbracast"
STEP_MS, STEPS = 100, 9
# A live run makes ten frames a second.
FASTEST_HZ = 10.0
# What others say is bounded: jobs, bytes of a request, seconds until an answer, failures in a row until a job waits.
JOBS_MAX, BODY_MAX, ANSWER_S, FAILURES = 256, 65536, 2.0, 3
REGISTER_EVERY_S = 30.0

# What a job may say (JSON Schema, as the coordinator asks for it). Everything has a default.
JOB_SCHEMA = {
    "$schema": "http://json-schema.org/draft-07/schema#",
    "title": TYPE,
    "description": "Which radio links a human body is about to block, how likely and when, and what to do about each device.",
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "links": {
            "type": "array",
            "items": {"type": "string"},
            "description": "Names of access points; without it all.",
        },
        "horizon_ms": {"type": "integer", "minimum": STEP_MS, "maximum": STEP_MS * STEPS, "default": 300},
        "min_p": {"type": "number", "minimum": 0, "maximum": 1, "default": 0.3},
        "max_rate_hz": {"type": "number", "exclusiveMinimum": 0, "maximum": FASTEST_HZ, "default": FASTEST_HZ},
    },
}


class Refused(Exception):
    """What a request holds is not what is expected."""


class Job:
    """What one consumer asked for."""

    def __init__(self, body):
        if not isinstance(body, dict):
            raise Refused("expected an object")
        self.id = text(body, "info_job_identity")
        if text(body, "info_type_identity") != TYPE:
            raise Refused(f"info_type_identity: expected {TYPE}, found {body['info_type_identity']!r}")
        self.target = text(body, "target_uri")
        if urlsplit(self.target).scheme not in ("http", "https"):
            raise Refused(f"target_uri: expected an http address, found {self.target!r}")
        asked = body.get("info_job_data") or {}
        if not isinstance(asked, dict):
            raise Refused("info_job_data: expected an object")
        unknown = sorted(set(asked) - set(JOB_SCHEMA["properties"]))
        if unknown:
            raise Refused(f"info_job_data: expected {', '.join(JOB_SCHEMA['properties'])}, found {', '.join(unknown)}")
        links = asked.get("links")
        if links is not None and not (isinstance(links, list) and all(isinstance(name, str) for name in links)):
            raise Refused("links: expected names of access points")
        self.links = None if links is None else set(links)
        self.horizon_ms = number(asked, "horizon_ms", 300, STEP_MS, STEP_MS * STEPS)
        self.min_p = number(asked, "min_p", 0.3, 0, 1)
        rate_hz = number(asked, "max_rate_hz", FASTEST_HZ, 1e-3, FASTEST_HZ)
        self.every_s = 1.0 / rate_hz
        self.due_s, self.failures, self.busy = 0.0, 0, False

    def wants(self, name):
        return self.links is None or name in self.links

    def result(self, frame):
        """What of a frame the job asked for; None where that is nothing."""
        window = max(1, min(STEPS, int(self.horizon_ms) // STEP_MS))
        links = []
        for link in frame.get("blockages", []):
            p, p_now = (chance(link, f"w{window}"), chance(link, "now"))
            if self.wants(link["access_point"]) and max(p, p_now) >= self.min_p:
                links.append(
                    {
                        "access_point": link["access_point"],
                        "track": link["track"],
                        "p_now": p_now,
                        f"p_{window * STEP_MS}_ms": p,
                        **{key: link.get(key) for key in ("onset_p10_s", "onset_p50_s", "onset_p90_s")},
                    }
                )
        kept = ("track", "serving", "action", "target", "deadline_s", "saved_s", "p_out")
        decisions = [
            {key: decision.get(key) for key in kept}
            for decision in frame.get("decisions") or []
            if decision.get("action") != "stay" and self.wants(decision.get("serving"))
        ]
        if not links and not decisions:
            return None
        head = {"type": TYPE, "job": self.id, "frame": frame["frame"], "time_ns": frame["time_ns"]}
        return {**head, "age_ms": frame.get("age_ms"), "links": links, "decisions": decisions}


def chance(link, when):
    """Blocked by anything, where that is told, else by other people."""
    for key in (f"p_any_{when}", f"p_{when}"):
        if link.get(key) is not None:
            return link[key]
    return 0.0


def text(body, key):
    if not isinstance(body.get(key), str) or not body[key]:
        raise Refused(f"{key}: expected a text, found {body.get(key)!r}")
    return body[key]


def number(body, key, usual, least, most):
    value = body.get(key, usual)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        raise Refused(f"{key}: expected a number from {least} to {most}, found {value!r}")
    return value


def ask(method, address, body=None, token=None):
    """One request; the answer's JSON, None where it is empty."""
    data = None if body is None else json.dumps(body).encode()
    heads = {"Content-Type": "application/json"}
    if token:
        heads["Authorization"] = f"Bearer {token}"
    request = urllib.request.Request(address, data=data, headers=heads, method=method)
    with urllib.request.urlopen(request, timeout=ANSWER_S) as answer:
        raw = answer.read()
    return json.loads(raw) if raw.strip() else None


class Producer:
    """Jobs, and the frames that they are served from."""

    def __init__(self, live, coordinator, public, token=None):
        self.live, self.token = live.rstrip("/"), token
        self.coordinator, self.public = coordinator.rstrip("/"), public.rstrip("/")
        self.jobs, self.lock = {}, threading.Lock()
        self.posted, self.failed = 0, 0
        self.ended = threading.Event()

    def register(self):
        """Tells the coordinator the type and who makes it. Both may be said again, so that a coordinator that was started
        anew knows them."""
        at = f"{self.coordinator}/data-producer/v1"
        ask("PUT", f"{at}/info-types/{TYPE}", {"info_job_data_schema": JOB_SCHEMA})
        ask(
            "PUT",
            f"{at}/info-producers/{PRODUCER}",
            {
                "supported_info_types": [TYPE],
                "info_job_callback_url": f"{self.public}/jobs",
                "info_producer_supervision_callback_url": f"{self.public}/supervision",
            },
        )

    def keep_registered(self):
        wait_s = 1.0
        while not self.ended.wait(0):
            try:
                self.register()
                wait_s = REGISTER_EVERY_S
            except (OSError, ValueError) as error:
                print(f"coordinator: {error}; tried again in {wait_s:.0f} s", file=sys.stderr)
            self.ended.wait(wait_s)
            wait_s = min(2 * wait_s, REGISTER_EVERY_S)

    def begin(self, body):
        job = Job(body)
        with self.lock:
            if job.id not in self.jobs and len(self.jobs) >= JOBS_MAX:
                raise Refused(f"expected at most {JOBS_MAX} jobs")
            self.jobs[job.id] = job

    def end(self, job_id):
        with self.lock:
            return self.jobs.pop(job_id, None) is not None

    def is_well(self):
        """The live run answers, and its frames are new."""
        try:
            ask("GET", f"{self.live}/health", token=self.token)
            return True
        except (OSError, ValueError):
            return False

    def serve_jobs(self):
        last = None
        while not self.ended.is_set():
            begun_s = time.monotonic()
            with self.lock:
                due = [job for job in self.jobs.values() if job.due_s <= begun_s and not job.busy]
            if due:
                try:
                    frame = ask("GET", f"{self.live}/api/frame?points=0", token=self.token)
                except (OSError, ValueError) as error:
                    print(f"live run: {error}", file=sys.stderr)
                    self.ended.wait(1.0)
                    continue
                if frame["time_ns"] != last:
                    last = frame["time_ns"]
                    for job in due:
                        job.due_s = begun_s + job.every_s
                        body = job.result(frame)
                        if body is not None:
                            job.busy = True  # A slow consumer holds up nobody but itself.
                            threading.Thread(target=self.post, args=(job, body), daemon=True).start()
            self.ended.wait(max(0.0, 1 / (2 * FASTEST_HZ) - (time.monotonic() - begun_s)))

    def post(self, job, body):
        try:
            ask("POST", job.target, body)
            job.failures = 0
            self.posted += 1
        except (OSError, ValueError) as error:
            job.failures += 1
            self.failed += 1
            # Who does not answer is asked ever more rarely, up to once a minute.
            if job.failures >= FAILURES:
                job.due_s = time.monotonic() + min(60.0, 2.0 ** (job.failures - FAILURES))
                print(f"{job.target}: {error}; job {job.id} waits", file=sys.stderr)
        finally:
            job.busy = False


def handler(producer):
    class Callbacks(BaseHTTPRequestHandler):
        """What the coordinator calls."""

        timeout = ANSWER_S

        def answer(self, code, body=""):
            raw = body.encode()
            self.send_response(code)
            self.send_header("Content-Type", "text/plain")
            self.send_header("Content-Length", str(len(raw)))
            self.end_headers()
            self.wfile.write(raw)

        def do_GET(self):
            if self.path != "/supervision":
                return self.answer(404)
            well = producer.is_well()
            return self.answer(200 if well else 503, "" if well else "the live run gives no frames\n")

        def do_POST(self):
            if self.path != "/jobs":
                return self.answer(404)
            length = self.headers.get("Content-Length", "")
            if not re.fullmatch(r"\d{1,6}", length) or int(length) > BODY_MAX:
                return self.answer(413, f"expected at most {BODY_MAX} bytes\n")
            try:
                producer.begin(json.loads(self.rfile.read(int(length))))
            except (ValueError, Refused) as error:
                return self.answer(400, f"{error}\n")
            return self.answer(200)

        def do_DELETE(self):
            found = self.path.startswith("/jobs/") and producer.end(self.path.removeprefix("/jobs/"))
            return self.answer(200 if found else 404)

        def log_message(self, *_):
            pass

    return Callbacks


def start(producer, listen):
    """Serves callbacks and jobs until `producer.ended`; gives the server."""
    host, port = listen.rsplit(":", 1)
    server = ThreadingHTTPServer((host, int(port)), handler(producer))
    for work in (server.serve_forever, producer.keep_registered, producer.serve_jobs):
        threading.Thread(target=work, daemon=True).start()
    return server


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--live", required=True, help="address of umbracast live --serve; its token in UMBRACAST_TOKEN")
    parser.add_argument("--coordinator", required=True, help="address of the information coordinator")
    parser.add_argument("--listen", default="127.0.0.1:8700", help="where the coordinator's calls are taken")
    parser.add_argument("--public", required=True, help="the address by which the coordinator reaches --listen")
    args = parser.parse_args()
    producer = Producer(args.live, args.coordinator, args.public, os.environ.get("UMBRACAST_TOKEN"))
    start(producer, args.listen)
    try:
        while True:
            time.sleep(60)
            print(f"{len(producer.jobs)} jobs, {producer.posted} results posted, {producer.failed} not taken")
    except KeyboardInterrupt:
        producer.ended.set()


if __name__ == "__main__":
    main()
