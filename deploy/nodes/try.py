#!/usr/bin/env python3
"""Reads what a container engine or a cluster would be given, runs every container's command on this machine, and says what the
fleet is: three halls, nodes that are well. Passwords, certificates and roles are those of the deployment. Needs PyYAML and
openssl; for Kubernetes, kubectl, which needs no cluster for this.

    deploy/nodes/try.py PROGRAM compose|kubernetes [SECONDS]
"""

import json
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time

import yaml

program, kind = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 12.0
here = pathlib.Path(__file__).resolve().parent


def free_port(of=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, of) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def of_compose(folder):
    """Name, command and mounted files of every service."""
    document = yaml.safe_load((folder / "compose.yaml").read_text())
    for name, service in document["services"].items():
        if service.get("profiles"):
            continue
        assert service["read_only"] and service["cap_drop"] == ["ALL"], name
        files = {f"/{c}": folder / document["configs"][c]["file"] for c in service.get("configs", [])}
        for secret in service.get("secrets", []):
            source, target = (secret, secret) if isinstance(secret, str) else (secret["source"], secret["target"])
            files[f"/run/secrets/{target}"] = folder / document["secrets"][source]["file"]
        yield name, name.removesuffix("-sim").removesuffix("-edge"), [str(word) for word in service["command"]], files


def of_kubernetes(folder):
    text = subprocess.run(["kubectl", "kustomize", folder], check=True, capture_output=True, text=True).stdout
    documents = list(yaml.safe_load_all(text))
    config = {d["metadata"]["name"]: d["data"] for d in documents if d["kind"] == "ConfigMap"}
    assert any(d["kind"] == "Service" and d["metadata"]["name"] == "router" for d in documents)
    sources = {"settings": folder, "secrets": folder / "secrets"}
    for deployment in (d for d in documents if d["kind"] == "Deployment"):
        pod = deployment["spec"]["template"]["spec"]
        assert pod["securityContext"]["runAsNonRoot"] and deployment["spec"]["selector"]["matchLabels"].items() <= (
            deployment["spec"]["template"]["metadata"]["labels"].items()
        )
        volumes = {v["name"]: v for v in pod.get("volumes", [])}
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
            name = f"{deployment['metadata']['name']}-{container['name']}"
            for replica in range(deployment["spec"]["replicas"]):
                yield f"{name}-{replica}", deployment["metadata"]["name"], [expanded(word) for word in container["args"]], files


with tempfile.TemporaryDirectory() as lab:
    lab = pathlib.Path(lab)
    folder = lab / "nodes"
    shutil.copytree(here, folder, ignore=shutil.ignore_patterns("secrets"))
    subprocess.run([folder / "secrets.sh", folder / "secrets", "router", "localhost"], check=True)
    router, packets, running = free_port(), {}, []

    def on_this_machine(words, group, files, own):
        """The command with its files, addresses and ports moved to this machine."""
        own.mkdir()
        for path, source in files.items():
            text = source.read_text()
            if source.suffix == ".toml":
                text = text.replace("/run/secrets/", f"{own}/run/secrets/")
                text = text.replace("tls/router:7447", f"tls/localhost:{router}").replace("tls/0.0.0.0:7447", f"tls/127.0.0.1:{router}")
            place = own / path.lstrip("/")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text)
        if "2368" in words or any(word.startswith("udp:") for word in words):
            port = packets.setdefault(group, free_port(socket.SOCK_DGRAM))
            words = [str(port) if word == "2368" else f"udp:127.0.0.1:{port}" if word.startswith("udp:") else word for word in words]
        return [program, *(str(own / word.lstrip("/")) if word in files else word for word in words)]

    try:
        services = list((of_compose if kind == "compose" else of_kubernetes)(folder))
        for name, group, words, files in sorted(services, key=lambda service: service[2][1] != "router"):
            command = on_this_machine(words, group, files, lab / name)
            log = open(lab / f"{name}.log", "w")
            running.append((name, subprocess.Popen(command, stdout=log, stderr=log)))
        # The operator looks, and stays what it is: a display.
        files = {"/hall.toml": folder / "hall.toml", "/run/secrets/ca.pem": folder / "secrets/ca.pem", "/run/secrets/login.txt": folder / "secrets/operator.txt"}
        look = on_this_machine(["fleet", "--site", "/hall.toml", "--json"], "", files, lab / "operator")
        time.sleep(seconds)
        said = subprocess.run(look, capture_output=True, text=True)
        gone = [name for name, process in running if process.poll() is not None and "sim" not in name]
        assert not gone, [(name, (lab / f"{name}.log").read_text()) for name in gone]
        fleet = json.loads(said.stdout)
        halls = {name: nodes for name, nodes in fleet.items() if name.startswith("hall_")}
        for name, nodes in sorted(fleet.items()):
            for node in nodes.values():
                print(f"{name}: {','.join(node['roles'])}, {node['frames']} frames, {node['troubles'] or 'well'}")
        assert sorted(halls) == ["hall_a", "hall_b", "hall_c"], (sorted(fleet), said.stderr)
        for name, nodes in halls.items():
            roles = {role for node in nodes.values() for role in node["roles"]}
            assert roles == {"sensor", "track", "forecast", "cast"}, (name, roles)
            assert all(node["frames"] > 0 for node in nodes.values()), (name, nodes)
        print(f"{kind}: {len(running)} containers, {len(halls)} halls, every stage of each has frames")
    finally:
        for _, process in running:
            process.terminate()
        for _, process in running:
            process.wait(timeout=20)
