#!/usr/bin/env python3
"""Reads reproduce.yaml and does what a cluster would do with it on this machine: every index of the indexed job, then
the merge, for a few scenes; then compares every byte with a single run. Needs PyYAML.

    deploy/kubernetes/try.py PROGRAM [FLAGS...]
"""

import filecmp
import os
import pathlib
import subprocess
import sys
import tempfile

import yaml

program, flags = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:] or ["--scenes", "2", "--people", "2"]
documents = list(yaml.safe_load_all(pathlib.Path(__file__).with_name("reproduce.yaml").read_text()))
claim, shards, merge = documents
assert [d["kind"] for d in documents] == ["PersistentVolumeClaim", "Job", "Job"]
assert shards["spec"]["completionMode"] == "Indexed" and merge["spec"]["suspend"] is True


def container(job):
    pod = job["spec"]["template"]["spec"]
    assert pod["volumes"][0]["persistentVolumeClaim"]["claimName"] == claim["metadata"]["name"]
    (found,) = pod["containers"]
    assert found["volumeMounts"] == [{"name": pod["volumes"][0]["name"], "mountPath": "/out"}]
    return found


def run(job, out, **environment):
    """The container's command, its volume being `out` and its program this one."""
    arguments = [a.replace("/out", str(out)) for a in container(job)["args"]]
    arguments = [a.replace("umbracast reproduce", " ".join(["umbracast reproduce --quiet", *flags])) for a in arguments]
    path = f"{out.parent}:{os.environ['PATH']}"
    command = container(job)["command"] + arguments
    return subprocess.run(command, env={**os.environ, "PATH": path, **environment}, check=True, capture_output=True)


with tempfile.TemporaryDirectory() as lab:
    out, single = pathlib.Path(lab, "out"), pathlib.Path(lab, "single")
    out.mkdir()
    pathlib.Path(lab, "umbracast").symlink_to(program)
    completions = shards["spec"]["completions"]
    for index in range(completions):
        run(shards, out, JOB_COMPLETION_INDEX=str(index))
    run(merge, out)
    subprocess.run([program, "reproduce", "--quiet", *flags, "--out", single], check=True, capture_output=True)
    files = sorted(p.relative_to(single) for p in single.rglob("*") if p.is_file() and p.name != "run.json")
    _, differing, missing = filecmp.cmpfiles(out, single, files, shallow=False)
    assert files and not differing and not missing, (differing, missing)
    print(f"{completions} indices and the merge: {len(files)} files, the same bytes as a single run")
