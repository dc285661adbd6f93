"""The planning pipelines that MoveIt brings with ``moveit_configs_utils``: its ``default_configs``, as values.

Source: https://github.com/moveit/moveit2, branches humble, jazzy, kilted and main; the last three are alike.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any


def default_pipelines(*, is_humble: bool) -> dict[str, dict[str, Any]]:
    """Return the parameters of each planning pipeline that MoveIt knows, by its name."""
    return deepcopy(_HUMBLE if is_humble else _SINCE_JAZZY)


def ompl_planner_configs() -> dict[str, Any]:
    """Return the parameters of OMPL's planners, for a pipeline that lists none."""
    planners = {name: {"type": f"geometric::{name}", **values} for name, values in _OMPL_PLANNERS.items()}
    return {"planner_configs": planners}


_HUMBLE_ADAPTERS = " ".join(
    f"default_planner_request_adapters/{name}"
    for name in (
        *("AddTimeOptimalParameterization", "ResolveConstraintFrames", "FixWorkspaceBounds"),
        *("FixStartStateBounds", "FixStartStateCollision", "FixStartStatePathConstraints"),
    )
)
_PILZ_CAPABILITIES = (
    "pilz_industrial_motion_planner/MoveGroupSequenceAction "
    "pilz_industrial_motion_planner/MoveGroupSequenceService"
)
_HUMBLE: dict[str, dict[str, Any]] = {
    "chomp": {
        "planning_plugin": "chomp_interface/CHOMPPlanner",
        "enable_failure_recovery": True,
        "jiggle_fraction": 0.05,
        "request_adapters": _HUMBLE_ADAPTERS,
        "ridge_factor": 0.01,
        "start_state_max_bounds_error": 0.1,
    },
    "ompl": {
        "planning_plugin": "ompl_interface/OMPLPlanner",
        "start_state_max_bounds_error": 0.1,
        "jiggle_fraction": 0.05,
        "request_adapters": _HUMBLE_ADAPTERS,
    },
    "pilz_industrial_motion_planner": {
        "planning_plugin": "pilz_industrial_motion_planner/CommandPlanner",
        "request_adapters": "",
        "default_planner_config": "PTP",
        "capabilities": _PILZ_CAPABILITIES,
    },
}

_REQUEST_ADAPTERS = [
    f"default_planning_request_adapters/{name}"
    for name in (
        *("ResolveConstraintFrames", "ValidateWorkspaceBounds"),
        *("CheckStartStateBounds", "CheckStartStateCollision"),
    )
]
_CHECKED = [
    "default_planning_response_adapters/ValidateSolution",
    "default_planning_response_adapters/DisplayMotionPath",
]
_ADAPTERS: dict[str, Any] = {
    "request_adapters": _REQUEST_ADAPTERS,
    "response_adapters": ["default_planning_response_adapters/AddTimeOptimalParameterization", *_CHECKED],
}
_SINCE_JAZZY: dict[str, dict[str, Any]] = {
    "chomp": {
        "planning_plugins": ["chomp_interface/CHOMPPlanner"],
        "enable_failure_recovery": True,
        **_ADAPTERS,
        "ridge_factor": 0.01,
    },
    "ompl": {"planning_plugins": ["ompl_interface/OMPLPlanner"], **_ADAPTERS},
    "pilz_industrial_motion_planner": {
        "planning_plugins": ["pilz_industrial_motion_planner/CommandPlanner"],
        "default_planner_config": "PTP",
        "request_adapters": _REQUEST_ADAPTERS,
        "response_adapters": _CHECKED,
        "capabilities": _PILZ_CAPABILITIES,
    },
    "stomp": {
        "planning_plugins": ["stomp_moveit/StompPlanner"],
        **_ADAPTERS,
        "stomp_moveit": {
            "num_timesteps": 60,
            "num_iterations": 40,
            "num_iterations_after_valid": 0,
            "num_rollouts": 30,
            "max_rollouts": 30,
            "exponentiated_cost_sensitivity": 0.8,
            "control_cost_weight": 0.1,
            "delta_t": 0.1,
        },
    },
}

# The texts that look like numbers are texts: PyYAML reads ``10e-10``, which has no point, as one.
_OMPL_PLANNERS: dict[str, dict[str, Any]] = {
    "AnytimePathShortening": {
        "shortcut": 1,
        "hybridize": 1,
        "max_hybrid_paths": 24,
        "num_planners": 4,
        "planners": "",
    },
    "SBL": {"range": 0.0},
    "EST": {"range": 0.0, "goal_bias": 0.05},
    "LBKPIECE": {"range": 0.0, "border_fraction": 0.9, "min_valid_path_fraction": 0.5},
    "BKPIECE": {
        "range": 0.0,
        "border_fraction": 0.9,
        "failed_expansion_score_factor": 0.5,
        "min_valid_path_fraction": 0.5,
    },
    "KPIECE": {
        "range": 0.0,
        "goal_bias": 0.05,
        "border_fraction": 0.9,
        "failed_expansion_score_factor": 0.5,
        "min_valid_path_fraction": 0.5,
    },
    "RRT": {"range": 0.0, "goal_bias": 0.05},
    "RRTConnect": {"range": 0.0},
    "RRTstar": {"range": 0.0, "goal_bias": 0.05, "delay_collision_checking": 1},
    "TRRT": {
        "range": 0.0,
        "goal_bias": 0.05,
        "max_states_failed": 10,
        "temp_change_factor": 2.0,
        "min_temperature": "10e-10",
        "init_temperature": "10e-6",
        "frountier_threshold": 0.0,
        "frountierNodeRatio": 0.1,
        "k_constant": 0.0,
    },
    "PRM": {"max_nearest_neighbors": 10},
    "PRMstar": {},
    "FMT": {
        "num_samples": 1000,
        "radius_multiplier": 1.1,
        "nearest_k": 1,
        "cache_cc": 1,
        "heuristics": 0,
        "extended_fmt": 1,
    },
    "BFMT": {
        "num_samples": 1000,
        "radius_multiplier": 1.0,
        "nearest_k": 1,
        "balanced": 0,
        "optimality": 1,
        "heuristics": 1,
        "cache_cc": 1,
        "extended_fmt": 1,
    },
    "PDST": {},
    "STRIDE": {
        "range": 0.0,
        "goal_bias": 0.05,
        "use_projected_distance": 0,
        "degree": 16,
        "max_degree": 18,
        "min_degree": 12,
        "max_pts_per_leaf": 6,
        "estimated_dimension": 0.0,
        "min_valid_path_fraction": 0.2,
    },
    "BiTRRT": {
        "range": 0.0,
        "temp_change_factor": 0.1,
        "init_temperature": 100,
        "frountier_threshold": 0.0,
        "frountier_node_ratio": 0.1,
        "cost_threshold": "1e300",
    },
    "LBTRRT": {"range": 0.0, "goal_bias": 0.05, "epsilon": 0.4},
    "BiEST": {"range": 0.0},
    "ProjEST": {"range": 0.0, "goal_bias": 0.05},
    "LazyPRM": {"range": 0.0},
    "LazyPRMstar": {},
    "SPARS": {
        "stretch_factor": 3.0,
        "sparse_delta_fraction": 0.25,
        "dense_delta_fraction": 0.001,
        "max_failures": 1000,
    },
    "SPARStwo": {
        "stretch_factor": 3.0,
        "sparse_delta_fraction": 0.25,
        "dense_delta_fraction": 0.001,
        "max_failures": 5000,
    },
}
