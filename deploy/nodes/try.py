#!/usr/bin/env python3
"""Reads what a container engine or a cluster would be given, and runs every container's command on this machine. Passwords,
certificates and roles are those of the deployment. Then it runs the command with which the files say that one looks, as the user that
has it there, until that ends with code 0: three halls, every stage there and well. Needs PyYAML and openssl; for Kubernetes, kubectl,
which needs no cluster for this.

    deploy/nodes/try.py PROGRAM compose|kubernetes [SECONDS]
"""

import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

import yaml

program, kind = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 90.0
here = pathlib.Path(__file__).resolve().parent


def free_port(of=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, of) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Container:
    """Of one: its name, the group that shares its address, the command, mounted files by path, and how its life is probed."""

    def __init__(self, name, group, words, files, probe=None):
        self.name, self.group, self.words, self.files, self.probe = name, group, words, files, probe

    def simulates(self):
        return self.words[0] == "simulate"


def of_compose(folder):
    """Every container that runs, and the one that looks."""
    text = (folder / "compose.yaml").read_text()
    document = yaml.safe_load(text)
    looks = re.search(r"^# +docker compose -f deploy/nodes/compose.yaml run --rm (\S+)$", text, re.M).group(1)
    containers, look = [], None
    for name, service in document["services"].items():
        assert service["read_only"] and service["cap_drop"] == ["ALL"], name
        assert re.fullmatch(r"[^:]+:\d+\.\d+\.\d+", service["image"]), f"{name}: a version of the image"
        files = {f"/{c}": folder / document["configs"][c]["file"] for c in service.get("configs", [])}
        for secret in service.get("secrets", []):
            source, target = (secret, secret) if isinstance(secret, str) else (secret["source"], secret["target"])
            files[f"/run/secrets/{target}"] = folder / document["secrets"][source]["file"]
        # What reads secrets runs as who may read them.
        assert not service.get("secrets") or "UMBRACAST_USER" in service["user"], name
        test = service.get("healthcheck", {}).get("test")
        probe = test and [word.replace("$$", "$") for word in test[1:]]
        container = Container(name, name.removesuffix("-sim").removesuffix("-edge"), [str(w) for w in service["command"]], files, probe)
        if name == looks:
            look = container
        elif not service.get("profiles"):
            assert probe or container.simulates(), f"{name}: how its life is probed"
            containers.append(container)
    return containers, look


def of_kubernetes(folder):
    """Every container that runs, and what looks from the inside of one of them."""
    text = subprocess.run(["kubectl", "kustomize", folder], check=True, capture_output=True, text=True).stdout
    documents = list(yaml.safe_load_all(text))
    config = {d["metadata"]["name"]: d["data"] for d in documents if d["kind"] == "ConfigMap"}
    assert any(d["kind"] == "Service" and d["metadata"]["name"] == "router" for d in documents)
    says = (folder / "kustomization.yaml").read_text()
    looks_from, looks = re.search(r"^# +kubectl exec deploy/(\S+) -- umbracast (.+)$", says, re.M).groups()
    containers, look = [], None
    sources = {"settings": folder, "secrets": folder / "secrets"}
    for deployment in (d for d in documents if d["kind"] == "Deployment"):
        pod, group = deployment["spec"]["template"]["spec"], deployment["metadata"]["name"]
        rights = pod["securityContext"]
        assert rights["runAsNonRoot"] and deployment["spec"]["selector"]["matchLabels"].items() <= (
            deployment["spec"]["template"]["metadata"]["labels"].items()
        )
        volumes = {v["name"]: v for v in pod.get("volumes", [])}
        # The group of the process may read its secrets, and nobody else.
        assert volumes["secrets"]["secret"]["defaultMode"] == 0o440 and rights["fsGroup"] == rights["runAsUser"], group
        for container in pod["containers"]:
            env = {e["name"]: config[e["valueFrom"]["configMapKeyRef"]["name"]][e["valueFrom"]["configMapKeyRef"]["key"]] for e in container.get("env", [])}

            def expanded(text):
                for key, value in env.items():
                    text = text.replace(f"$({key})", value)
                return text

            files = {}
            for mount in container.get("volumeMounts", []):
                assert mount["name"] in volumes
                files[mount["mountPath"]] = sources[mount["name"]] / expanded(mount.get("subPath") or mount["subPathExpr"])
            name, words = f"{group}-{container['name']}", [expanded(word) for word in container["args"]]
            assert re.fullmatch(r"[^:]+:\d+\.\d+\.\d+", container["image"]), f"{name}: a version of the image"
            probe = container.get("livenessProbe", {}).get("httpGet")
            assert probe or words[0] == "simulate", f"{name}: how its life is probed"
            if probe:
                probe = ["curl", "--fail", "--silent", "--max-time", "3", f"http://127.0.0.1:{probe['port']}{probe['path']}"]
            for replica in range(deployment["spec"]["replicas"]):
                containers.append(Container(f"{name}-{replica}", group, words, files, probe))
            if group == looks_from and container is pod["containers"][0]:
                look = Container("look", group, looks.split(), files)
    return containers, look


with tempfile.TemporaryDirectory() as lab:
    lab = pathlib.Path(lab)
    folder = lab / "nodes"
    shutil.copytree(here, folder, ignore=shutil.ignore_patterns("secrets"))
    subprocess.run([folder / "secrets.sh", folder / "secrets", "router", "localhost"], check=True)
    open_to_others = [file.name for file in (folder / "secrets").iterdir() if file.stat().st_mode & 0o077]
    assert not open_to_others, open_to_others
    router, packets, running = free_port(), {}, {}

    def on_this_machine(container):
        """Its command and its probe, with files, addresses and ports moved to this machine."""
        own = lab / container.name
        own.mkdir()
        for path, source in container.files.items():
            text = source.read_text()
            if source.suffix == ".toml":
                text = text.replace("/run/secrets/", f"{own}/run/secrets/")
                text = text.replace("tls/router:7447", f"tls/localhost:{router}").replace("tls/0.0.0.0:7447", f"tls/127.0.0.1:{router}")
            place = own / path.lstrip("/")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text)
            if "/run/secrets/" in path:
                place.chmod(0o440 if kind == "kubernetes" else 0o600)
        words, probe = container.words, container.probe
        if "2368" in words or container.simulates():
            port = packets.setdefault(container.group, free_port(socket.SOCK_DGRAM))
            words = [str(port) if word == "2368" else f"udp:127.0.0.1:{port}" if word.startswith("udp:") else word for word in words]
        if "--probe" in words:
            (place, port), free = words[words.index("--probe") + 1].rsplit(":", 1), free_port()
            words = [f"127.0.0.1:{free}" if word == f"{place}:{port}" else word for word in words]
            assert any(port in word for word in probe), (container.name, probe)
            probe = [word.replace(port, str(free)) for word in probe]
        return [program, *(str(own / word.lstrip("/")) if word in container.files else word for word in words)], probe

    def start(name, command):
        with open(lab / f"{name}.log", "a") as log:
            running[name] = subprocess.Popen(command, stdout=log, stderr=log)

    try:
        containers, look = (of_compose if kind == "compose" else of_kubernetes)(folder)
        moved = {container.name: (container, *on_this_machine(container)) for container in [*containers, look]}
        for container in sorted(containers, key=lambda container: container.words[1] != "router"):
            start(container.name, moved[container.name][1])
        # Until it ends with code 0. A container that ends is started anew, as an engine would; a node does not end.
        began, code = time.monotonic(), None
        while code != 0 and time.monotonic() - began < seconds:
            time.sleep(1)
            for container, command, _ in moved.values():
                process = running.get(container.name)
                if process and process.poll() is not None:
                    assert container.simulates(), (container.name, (lab / f"{container.name}.log").read_text())
                    start(container.name, command)
            said = subprocess.run(moved[look.name][1], capture_output=True, text=True)
            code = said.returncode
        print(said.stdout, end="")
        assert code == 0, f"{' '.join(map(str, look.words))} ended with code {code}: {said.stderr}"
        # The same for programs: every stage of each hall has frames.
        said = subprocess.run([*moved[look.name][1], "--json"], capture_output=True, text=True)
        fleet = json.loads(said.stdout)
        halls = {name: hall["nodes"] for name, hall in fleet.items() if name.startswith("hall_")}
        assert sorted(halls) == ["hall_a", "hall_b", "hall_c"], (sorted(fleet), said.stderr)
        for name, nodes in halls.items():
            roles = {role for node in nodes.values() for role in node["roles"]}
            assert roles == {"sensor", "track", "forecast", "cast"}, (name, roles)
            assert all(node["frames"] > 0 for node in nodes.values()), (name, nodes)
        probes = [(container, probe) for container, _, probe in moved.values() if probe]
        for container, probe in probes:
            subprocess.run(probe, check=True, stdout=subprocess.DEVNULL)
        # A node that hangs is found by its probe.
        container, probe = next((container, probe) for container, probe in probes if "sensor" in container.words)
        os.kill(running[container.name].pid, signal.SIGSTOP)
        assert subprocess.run(probe, timeout=30, stdout=subprocess.DEVNULL).returncode != 0, f"{container.name} hangs"
        os.kill(running[container.name].pid, signal.SIGCONT)
        print(
            f"{kind}: {len(containers)} containers, {len(halls)} halls; `{' '.join(map(str, look.words))}` ends with code 0 after "
            f"{time.monotonic() - began:.0f} s; {len(probes)} probes find their nodes alive, and one that was stopped hanging"
        )
    finally:
        for process in running.values():
            process.terminate()
        for process in running.values():
            process.wait(timeout=20)
