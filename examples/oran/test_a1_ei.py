#!/usr/bin/env python3
"""Producer and consumer beside a stub of the information coordinator and of a live run: `python3 examples/oran/test_a1_ei.py`.

The stub knows the fields that the coordinator's OpenAPI document requires (ProducerRegistrationInfo, ProducerInfoTypeInfo,
ProducerInfoJob, EiJobObject of O-RAN SC's nonrtric-plt-informationcoordinatorservice, api/ics-api.json) and refuses others."""

import json
import sys
import threading
import time
import unittest
import urllib.error
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import a1_ei_producer as producer_of
import consumer
from a1_ei_producer import TYPE, Job, Refused, ask

REQUIRED = {
    "info-types": {"info_job_data_schema"},
    "info-producers": {"supported_info_types", "info_job_callback_url", "info_producer_supervision_callback_url"},
    "eijobs": {"eiTypeId", "jobOwner", "jobDefinition", "jobResultUri"},
}
OPTIONAL = {"eijobs": {"jobStatusNotificationUri"}}


def serve(answer):
    """A server on a free port that answers by `answer(method, path, body)`, with a code and an object."""

    class Handler(BaseHTTPRequestHandler):
        def any(self):
            length = int(self.headers.get("Content-Length") or 0)
            body = json.loads(self.rfile.read(length)) if length else None
            code, out = answer(self.command, self.path, body)
            raw = json.dumps(out).encode() if out is not None else b""
            self.send_response(code)
            self.send_header("Content-Length", str(len(raw)))
            self.end_headers()
            self.wfile.write(raw)

        do_GET = do_PUT = do_POST = do_DELETE = any

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server, f"http://127.0.0.1:{server.server_address[1]}"


class Coordinator:
    """As much of the service as producers and consumers meet."""

    def __init__(self):
        self.types, self.producers, self.refused = {}, {}, []
        self.server, self.address = serve(self.answer)

    def answer(self, method, path, body):
        *_, kind, name = path.split("/")
        fields = set(body or {})
        if method != "PUT" or kind not in REQUIRED:
            return 404, None
        if REQUIRED[kind] - fields or fields - REQUIRED[kind] - OPTIONAL.get(kind, set()):
            self.refused.append((kind, sorted(fields)))
            return 400, {"status": 400, "detail": "fields"}
        if kind == "info-types":
            self.types[name] = body
        elif kind == "info-producers":
            if not set(body["supported_info_types"]) <= set(self.types):
                return 404, {"status": 404, "detail": "type"}
            self.producers[name] = body
        else:
            for producer in self.producers.values():
                ask("POST", producer["info_job_callback_url"], job(body["jobResultUri"], body["jobDefinition"], name))
        return 201, None


def job(target, asked=None, name="j1"):
    return {
        "info_job_identity": name,
        "info_type_identity": TYPE,
        "info_job_data": asked or {},
        "target_uri": target,
        "owner": "test",
        "last_updated": "2026-01-01T00:00:00Z",
    }


class Live:
    """A live run whose frames say the same ten times a second."""

    def __init__(self):
        self.begun, self.well = time.monotonic(), True
        self.server, self.address = serve(self.answer)

    def answer(self, _method, path, _body):
        if path == "/health":
            return (200 if self.well else 503), {"well": self.well}
        frame = int((time.monotonic() - self.begun) * 10)
        link = {"track": 7, "p_now": 0.0, "onset_p10_s": 0.1, "onset_p50_s": 0.2, "onset_p90_s": 0.4}
        links = [
            {"access_point": "east", "p_w3": 0.8, "p_any_w3": None, **link},
            {"access_point": "north", "p_w3": 0.05, "p_any_w3": 0.1, **link},
        ]
        advised = {"track": 7, "serving": "east", "target": "north", "action": "prepare", "deadline_s": 0.1}
        decision = {**advised, "saved_s": 0.08, "p_out": 0.7}
        frame = {"frame": frame, "time_ns": frame * 10**8, "age_ms": 3, "blockages": links, "decisions": [decision]}
        return 200, frame


class A1Ei(unittest.TestCase):
    def setUp(self):
        self.coordinator, self.live = Coordinator(), Live()
        self.producer = producer_of.Producer(self.live.address, self.coordinator.address, "http://unset")
        self.server = producer_of.ThreadingHTTPServer(("127.0.0.1", 0), producer_of.handler(self.producer))
        self.public = f"http://127.0.0.1:{self.server.server_address[1]}"
        self.producer.public = self.public
        for work in (self.server.serve_forever, self.producer.keep_registered, self.producer.serve_jobs):
            threading.Thread(target=work, daemon=True).start()
        self.until(lambda: self.coordinator.producers)

    def tearDown(self):
        self.producer.ended.set()
        for server in (self.server, self.coordinator.server, self.live.server):
            server.shutdown()
            server.server_close()

    def until(self, true, seconds=60.0):
        end = time.monotonic() + seconds
        while not true():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.01)

    def test_registers_serves_a_job_and_ends_it(self):
        self.assertEqual(self.coordinator.refused, [])
        self.assertEqual(self.coordinator.types[TYPE]["info_job_data_schema"]["title"], TYPE)
        results, requests = [], []

        def take(result):
            results.append(result)
            requests.extend(consumer.requests_of(result))

        taking = consumer.start("127.0.0.1:0", take)
        consumer.ask_for(self.coordinator.address, f"http://127.0.0.1:{taking.server_address[1]}", min_p=0.5)
        self.until(lambda: len(results) >= 3)
        self.assertEqual([(link["access_point"], link["p_300_ms"]) for link in results[0]["links"]], [("east", 0.8)])
        self.assertEqual(results[0]["job"], consumer.JOB)
        self.assertTrue(all(a["frame"] < b["frame"] for a, b in zip(results, results[1:])), "no frame twice")
        self.assertEqual(requests[0]["control-action"]["id"], 2)
        self.assertEqual((requests[0]["ric-style-type"], requests[0]["target-cell"]), (3, "north"))
        ask("DELETE", f"{self.public}/jobs/{consumer.JOB}")
        time.sleep(0.3)
        count = len(results)
        time.sleep(0.5)
        self.assertEqual(len(results), count, "an ended job is served no more")
        taking.shutdown()
        taking.server_close()

    def test_supervision_says_when_the_live_run_is_not_well(self):
        ask("GET", f"{self.public}/supervision")
        self.live.well = False
        with self.assertRaises(urllib.error.HTTPError) as refusal:
            ask("GET", f"{self.public}/supervision")
        self.assertEqual(refusal.exception.code, 503)

    def test_a_job_that_asks_for_what_is_not_there_is_refused_with_a_reason(self):
        for asked, reason in [
            ({"horizon_ms": 5000}, "horizon_ms: expected a number from 100 to 900, found 5000"),
            ({"min_p": "a"}, "min_p"),
            ({"rate": 1}, "found rate"),
            ({"links": "east"}, "links"),
        ]:
            with self.assertRaises(urllib.error.HTTPError) as refusal:
                ask("POST", f"{self.public}/jobs", job("http://127.0.0.1:1/", asked))
            self.assertEqual(refusal.exception.code, 400)
            self.assertIn(reason, refusal.exception.read().decode())
        with self.assertRaises(Refused):
            Job(job("file:///etc/passwd"))
        with self.assertRaises(urllib.error.HTTPError):
            ask("DELETE", f"{self.public}/jobs/none")

    def test_a_consumer_that_does_not_answer_is_asked_more_rarely_and_holds_up_nobody(self):
        results = []
        taking = consumer.start("127.0.0.1:0", results.append)
        ask("POST", f"{self.public}/jobs", job("http://127.0.0.1:1/nobody", name="gone"))
        ask("POST", f"{self.public}/jobs", job(f"http://127.0.0.1:{taking.server_address[1]}/", name="here"))
        self.until(lambda: len(results) >= 10)
        self.until(lambda: self.producer.jobs["gone"].failures > producer_of.FAILURES)
        self.assertLess(self.producer.jobs["gone"].failures, len(results))
        taking.shutdown()
        taking.server_close()

    def test_the_rate_that_a_job_asks_for_is_kept(self):
        results = []
        taking = consumer.start("127.0.0.1:0", results.append)
        asked = {"max_rate_hz": 2}
        ask("POST", f"{self.public}/jobs", job(f"http://127.0.0.1:{taking.server_address[1]}/", asked, "slow"))
        self.until(lambda: results)
        begun, had = time.monotonic(), len(results)
        time.sleep(2.0)
        self.assertLessEqual(len(results) - had, 2 * (time.monotonic() - begun) + 1)
        taking.shutdown()
        taking.server_close()


if __name__ == "__main__":
    unittest.main()
