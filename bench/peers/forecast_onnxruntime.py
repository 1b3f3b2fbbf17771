"""ONNX Runtime, one thread, with the same weights: its LSTM over what was observed, then one step of it at a time."""

import pathlib

import numpy as np
import onnxruntime
from onnx import TensorProto, helper, numpy_helper
from safetensors.numpy import load_file

from exchange import Answer, read, times

STEPS = 9
WEIGHTS = pathlib.Path(__file__).parents[2] / "models" / "paper_lstm.safetensors"


def model():
    """The network as a graph. ONNX wants the gates in the order i o f g, and time before people."""
    tensors = load_file(WEIGHTS)
    units = tensors["enc.weight_hh"].shape[1]
    order = np.concatenate([np.arange(units) + gate * units for gate in (0, 3, 1, 2)])
    constants = {
        "emb_w": tensors["emb.weight"].T,
        "emb_b": tensors["emb.bias"],
        "w": tensors["enc.weight_ih"][order][None],
        "r": tensors["enc.weight_hh"][order][None],
        "b": np.concatenate([tensors["enc.bias_ih"][order], tensors["enc.bias_hh"][order]])[None],
        "dec_w": tensors["dec.weight"].T,
        "dec_b": tensors["dec.bias"],
        "from": np.array([0], dtype=np.int64),
        "to": np.array([2], dtype=np.int64),
        "axis": np.array([2], dtype=np.int64),
    }
    nodes, state, fed, raws = [], ["", ""], "observed", []
    for step in range(STEPS):
        name = lambda what: f"{what}_{step}"
        nodes += [
            helper.make_node("MatMul", [fed, "emb_w"], [name("e0")]),
            helper.make_node("Add", [name("e0"), "emb_b"], [name("e1")]),
            helper.make_node("Relu", [name("e1")], [name("e2")]),
            helper.make_node(
                "LSTM", [name("e2"), "w", "r", "b", "", *state], ["", name("h"), name("c")], hidden_size=units
            ),
            helper.make_node("MatMul", [name("h"), "dec_w"], [name("d")]),
            helper.make_node("Add", [name("d"), "dec_b"], [name("raw")]),
            helper.make_node("Slice", [name("raw"), "from", "to", "axis"], [name("mean")]),
        ]
        state, fed = [name("h"), name("c")], name("mean")
        raws.append(name("raw"))
    nodes.append(helper.make_node("Concat", raws, ["foreseen"], axis=0))
    graph = helper.make_graph(
        nodes,
        "forecast",
        [helper.make_tensor_value_info("observed", TensorProto.FLOAT, [None, None, 2])],
        [helper.make_tensor_value_info("foreseen", TensorProto.FLOAT, [STEPS, None, 5])],
        [numpy_helper.from_array(np.ascontiguousarray(v), k) for k, v in constants.items()],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    return made.SerializeToString()


options = onnxruntime.SessionOptions()
options.intra_op_num_threads = options.inter_op_num_threads = 1
session = onnxruntime.InferenceSession(model(), options, providers=["CPUExecutionProvider"])
answer = Answer()
for people in [10, 100]:
    observed_m = np.ascontiguousarray(read(f"observed_{people}").transpose(1, 0, 2))
    ms, foreseen = times(30, lambda: session.run(["foreseen"], {"observed": observed_m})[0])
    foreseen, ours = foreseen.transpose(1, 0, 2), read(f"foreseen_{people}")
    sigma_m = 0.001 + 0.1 * np.logaddexp(0.0, foreseen[..., 2:4])
    apart_m = max(np.abs(foreseen[..., :2] - ours[..., :2]).max(), np.abs(sigma_m - np.sqrt(ours[..., [2, 4]])).max())
    way_m = np.linalg.norm(foreseen[..., :2], axis=2).sum(1).mean()
    answer.case(f"{people} people", ms, {"mean way, m": way_m, "most apart, m": apart_m})
answer.print()
