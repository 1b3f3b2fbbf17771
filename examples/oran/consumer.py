#!/usr/bin/env python3
"""Consumes what `a1_ei_producer.py` makes, as a near-RT RIC would, and prints the handover request that each decision means.

    python3 examples/oran/consumer.py --coordinator http://ics:8083 --listen 0.0.0.0:8710 --public http://ric:8710

It asks for a job by A1-EI (PUT /A1-EI/v1/eijobs/{id}) and takes results at its own address. The requests are those of E2SM-RC,
control service style 3 (connected mode mobility): handover control (action 1) and conditional handover control (action 2). They
are printed and not sent: E2 needs the network's own identity of the device, and which track is which device only that network
can say. Patents may cover conditional handover by prediction; this is an example of the interface.
"""

import argparse
import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from a1_ei_producer import TYPE, ask

JOB = "umbracast-example"
# Names of E2SM-RC: control style 3, its actions by what a decision says.
STYLE = {"ric-style-type": 3, "name": "Connected Mode Mobility Control"}
ACTIONS = {"hand-over": (1, "Handover Control"), "prepare": (2, "Conditional Handover Control")}
BODY_MAX = 1 << 20


def requests_of(result):
    """The control requests that a result means; decisions to wait or stay mean none."""
    requests = []
    for decision in result.get("decisions", []):
        if decision.get("action") not in ACTIONS or not decision.get("target"):
            continue
        number, name = ACTIONS[decision["action"]]
        requests.append(
            {
                **STYLE,
                "control-action": {"id": number, "name": name},
                "ue": {"umbracast_track": decision["track"]},
                "serving-cell": decision["serving"],
                "target-cell": decision["target"],
                "deadline_s": decision["deadline_s"],
                "reason": f"out with probability {decision['p_out']:.2f}; saves {decision['saved_s']:.3f} s",
            }
        )
    return requests


def start(listen, take):
    """Takes results until the process ends; gives the server."""

    class Results(BaseHTTPRequestHandler):
        def do_POST(self):
            length = int(self.headers.get("Content-Length") or 0)
            try:
                result = json.loads(self.rfile.read(length)) if length <= BODY_MAX else None
            except ValueError:
                result = None
            self.send_response(200 if isinstance(result, dict) else 400)
            self.send_header("Content-Length", "0")
            self.end_headers()
            if isinstance(result, dict) and "links" in result:
                take(result)

        def log_message(self, *_):
            pass

    host, port = listen.rsplit(":", 1)
    server = ThreadingHTTPServer((host, int(port)), Results)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def ask_for(coordinator, public, **asked):
    """Asks for the job; the coordinator tells the producer."""
    ask(
        "PUT",
        f"{coordinator.rstrip('/')}/A1-EI/v1/eijobs/{JOB}",
        {
            "eiTypeId": TYPE,
            "jobOwner": "example-consumer",
            "jobDefinition": asked,
            "jobResultUri": f"{public.rstrip('/')}/results",
            "jobStatusNotificationUri": f"{public.rstrip('/')}/status",
        },
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--coordinator", required=True)
    parser.add_argument("--listen", default="127.0.0.1:8710")
    parser.add_argument("--public", required=True, help="the address by which the producer reaches --listen")
    parser.add_argument("--min-p", type=float, default=0.3)
    args = parser.parse_args()
    start(args.listen, lambda result: [print(json.dumps(request), flush=True) for request in requests_of(result)])
    ask_for(args.coordinator, args.public, min_p=args.min_p)
    while True:
        time.sleep(60)


if __name__ == "__main__":
    main()
