"""``launch.conditions``."""

from enclave_launch.description.launch.conditions.evaluate_condition_expression_impl import (
    evaluate_condition_expression,
)
from enclave_launch.description.launch.conditions.if_condition import IfCondition
from enclave_launch.description.launch.conditions.invalid_condition_expression_error import (
    InvalidConditionExpressionError,
)
from enclave_launch.description.launch.conditions.launch_configuration_equals import LaunchConfigurationEquals
from enclave_launch.description.launch.conditions.launch_configuration_not_equals import (
    LaunchConfigurationNotEquals,
)
from enclave_launch.description.launch.conditions.unless_condition import UnlessCondition

__all__ = [
    "IfCondition",
    "InvalidConditionExpressionError",
    "LaunchConfigurationEquals",
    "LaunchConfigurationNotEquals",
    "UnlessCondition",
    "evaluate_condition_expression",
]
