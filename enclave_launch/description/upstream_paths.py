"""The upstream module of each public name, and ours: nothing else in this package cares where upstream has a name."""

from __future__ import annotations

from enclave_launch.ros_rules.distro import Feature, Since

# package -> module below it -> "our module: names the package has as well | names of that module only".
# The module "" are names that only the package has; "*" is every public name of our module.
PATHS: dict[str, dict[str, str]] = {
    "ament_index_python": {
        "constants": "ament_index: RESOURCE_INDEX_SUBFOLDER | AMENT_PREFIX_PATH_ENV_VAR",
        "packages": (
            "ament_index: PackageNotFoundError get_package_prefix get_package_share_directory "
            "get_package_share_path get_packages_with_prefixes"
        ),
        "resources": (
            "ament_index: InvalidResourceNameError InvalidResourceTypeNameError get_resource "
            "get_resource_types get_resources has_resource"
        ),
        "search_paths": "ament_index: get_search_paths",
    },
    "launch": {
        "action": "entity: Action",
        "condition": "conditions: Condition",
        "event": "events.event: Event",
        "event_handler": "events.handlers: EventHandler | BaseEventHandler",
        "invalid_launch_file_error": "markup.parser: InvalidLaunchFileError",
        "launch_context": "launch_context: LaunchContext",
        "launch_description": "launch_description: LaunchDescription",
        "launch_description_entity": "entity: LaunchDescriptionEntity",
        "launch_description_source": "sources: LaunchDescriptionSource",
        "launch_introspector": (
            "introspection: LaunchIntrospector | format_action format_entities format_event_handler "
            "format_substitutions indent tree_like_indent"
        ),
        "launch_service": "launch_service: LaunchService",
        "some_actions_type": "entity: SomeActionsType SomeActionsType_types_tuple",
        "some_entities_type": "entity: SomeEntitiesType SomeEntitiesType_types_tuple",
        "some_substitutions_type": "substitution: SomeSubstitutionsType SomeSubstitutionsType_types_tuple",
        "substitution": "substitution: Substitution",
    },
    "launch.actions": {
        "append_environment_variable": "actions.environment: AppendEnvironmentVariable",
        "declare_boolean_launch_argument": "actions.arguments: DeclareBooleanLaunchArgument",
        "declare_launch_argument": "actions.arguments: DeclareLaunchArgument",
        "emit_event": "actions.events: EmitEvent",
        "execute_local": "actions.processes: ExecuteLocal",
        "execute_process": "actions.processes: ExecuteProcess",
        "for_loop": "actions.flow: ForEach ForLoop",
        "group_action": "actions.flow: GroupAction",
        "include_launch_description": "actions.includes: IncludeLaunchDescription",
        "log": "actions.log: Log LogDebug LogError LogWarning",
        "log_info": "actions.log: LogInfo",
        "opaque_coroutine": "actions.flow: OpaqueCoroutine",
        "opaque_function": "actions.flow: OpaqueFunction",
        "pop_environment": "actions.environment: PopEnvironment",
        "pop_launch_configurations": "actions.configurations: PopLaunchConfigurations",
        "push_environment": "actions.environment: PushEnvironment",
        "push_launch_configurations": "actions.configurations: PushLaunchConfigurations",
        "register_event_handler": "actions.events: RegisterEventHandler",
        "replace_environment_variables": "actions.environment: ReplaceEnvironmentVariables",
        "reset_environment": "actions.environment: ResetEnvironment",
        "reset_launch_configurations": "actions.configurations: ResetLaunchConfigurations",
        "set_environment_variable": "actions.environment: SetEnvironmentVariable",
        "set_launch_configuration": "actions.configurations: SetLaunchConfiguration",
        "shutdown_action": "actions.events: Shutdown",
        "timer_action": "actions.timers: TimerAction",
        "unregister_event_handler": "actions.events: UnregisterEventHandler",
        "unset_environment_variable": "actions.environment: UnsetEnvironmentVariable",
        "unset_launch_configuration": "actions.configurations: UnsetLaunchConfiguration",
    },
    "launch.conditions": {
        "evaluate_condition_expression_impl": (
            "conditions: evaluate_condition_expression | VALID_FALSE_EXPRESSIONS VALID_TRUE_EXPRESSIONS"
        ),
        "if_condition": "conditions: IfCondition",
        "invalid_condition_expression_error": "conditions: InvalidConditionExpressionError",
        "launch_configuration_equals": "conditions: LaunchConfigurationEquals",
        "launch_configuration_not_equals": "conditions: LaunchConfigurationNotEquals",
        "unless_condition": "conditions: UnlessCondition",
    },
    "launch.descriptions": {
        "executable": "actions.executable: Executable",
    },
    "launch.event_handlers": {
        "event_named": "events.event: event_named",
        "on_action_event_base": "events.handlers: | OnActionEventBase",
        "on_execution_complete": "events.handlers: OnExecutionComplete",
        "on_include_launch_description": "events.handlers: OnIncludeLaunchDescription",
        "on_process_exit": "actions.processes: OnProcessExit",
        "on_process_io": "actions.processes: OnProcessIO",
        "on_process_start": "actions.processes: OnProcessStart",
        "on_shutdown": "events.handlers: OnShutdown",
    },
    "launch.events": {
        "execution_complete": "events.event: ExecutionComplete",
        "include_launch_description": "events.event: IncludeLaunchDescription",
        "matchers": "events.event: matches_action",
        "shutdown": "events.event: Shutdown",
        "timer_event": "events.event: TimerEvent",
    },
    "launch.events.process": {
        "process_exited": "events.event: ProcessExited",
        "process_io": "events.event: ProcessIO",
        "process_matchers": "events.event: matches_executable matches_name matches_pid",
        "process_started": "events.event: ProcessStarted",
        "process_stderr": "events.event: ProcessStderr",
        "process_stdin": "events.event: ProcessStdin",
        "process_stdout": "events.event: ProcessStdout",
        "process_targeted_event": "events.event: ProcessTargetedEvent",
        "running_process_event": "events.event: RunningProcessEvent",
        "shutdown_process": "events.event: ShutdownProcess",
        "signal_process": "events.event: SignalProcess",
    },
    "launch.frontend": {
        "entity": "markup.entity: Entity",
        "expose": (
            "markup.expose: expose_action expose_substitution | action_parse_methods "
            "instantiate_action instantiate_substitution substitution_parse_methods"
        ),
        "parse_substitution": (
            "markup.parse_substitution: | parse_if_substitutions parse_substitution "
            "replace_escaped_characters"
        ),
        "parser": "markup.parser: InvalidFrontendLaunchFileError Parser",
        "type_utils": "markup.entity: | check_is_list_entity get_data_type_from_identifier",
    },
    "launch.launch_description_sources": {
        "": "sources: InvalidLaunchFileError",
        "any_launch_description_source": "sources: AnyLaunchDescriptionSource",
        "any_launch_file_utilities": "sources: get_launch_description_from_any_launch_file",
        "frontend_launch_description_source": "sources: FrontendLaunchDescriptionSource",
        "frontend_launch_file_utilities": (
            "sources: InvalidFrontendLaunchFileError get_launch_description_from_frontend_launch_file"
        ),
        "python_launch_description_source": "sources: PythonLaunchDescriptionSource",
        "python_launch_file_utilities": (
            "sources: InvalidPythonLaunchFileError get_launch_description_from_python_launch_file "
            "load_python_launch_file_as_module"
        ),
    },
    "launch.logging": {
        "": "logging: LaunchConfig get_logger get_output_loggers launch_config log_launch_config reset",
        "handlers": "logging_handlers: | FileHandler StreamHandler with_per_logger_formatting",
    },
    "launch.substitutions": {
        "anon_name": "substitutions.variables: AnonName",
        "boolean_substitution": (
            "substitutions.logic: AllSubstitution AndSubstitution AnySubstitution NotSubstitution "
            "OrSubstitution"
        ),
        "command": "substitutions.computed: Command",
        "environment_variable": "substitutions.variables: EnvironmentVariable",
        "equals_substitution": "substitutions.logic: EqualsSubstitution",
        "file_content": "substitutions.computed: FileContent",
        "find_executable": "substitutions.computed: FindExecutable",
        "for_loop_var": "substitutions.variables: ForEachVar ForLoopIndex",
        "if_else_substitution": "substitutions.logic: IfElseSubstitution",
        "launch_configuration": "substitutions.variables: LaunchConfiguration",
        "launch_log_dir": "substitutions.paths: LaunchLogDir",
        "local_substitution": "substitutions.variables: LocalSubstitution",
        "not_equals_substitution": "substitutions.logic: NotEqualsSubstitution",
        "path_join_substitution": "substitutions.paths: PathJoinSubstitution",
        "path_substitution": "substitutions.paths: PathSubstitution",
        "python_expression": "substitutions.computed: PythonExpression",
        "string_join_substitution": "substitutions.computed: StringJoinSubstitution",
        "substitution_failure": "substitution: SubstitutionFailure",
        "text_substitution": "substitution: TextSubstitution",
        "this_launch_file": "substitutions.paths: ThisLaunchFile",
        "this_launch_file_dir": "substitutions.paths: ThisLaunchFileDir",
    },
    "launch.utilities": {
        "class_tools_impl": "argument_types: is_a is_a_subclass isclassinstance",
        "create_future_impl": "launch_service: create_future",
        "ensure_argument_type_impl": "argument_types: ensure_argument_type",
        "normalize_to_list_of_entities_impl": "entity: normalize_to_list_of_entities",
        "normalize_to_list_of_substitutions_impl": "substitution: normalize_to_list_of_substitutions",
        "perform_substitutions_impl": "substitution: perform_substitutions",
        "signal_management": "launch_service: AsyncSafeSignalManager",
        "type_utils": "type_utils: | *",
        "typing_file_path": "argument_types: | FilePath",
        "visit_all_entities_and_collect_futures_impl": "visit: visit_all_entities_and_collect_futures",
    },
    "launch_ros": {
        "node_action_extension": "actions.nodes: | NodeActionExtension",
        "parameter_descriptions": "parameters.descriptions: | Parameter ParameterFile ParameterValue",
        "parameters_type": "parameters.types: | *",
        "remap_rule_type": "node_names: | RemapRule RemapRules SomeRemapRule SomeRemapRules",
        "ros_adapters": "ros_adapter: | ROSAdapter get_ros_adapter get_ros_node",
    },
    "launch_ros.actions": {
        "composable_node_container": "actions.containers: ComposableNodeContainer",
        "lifecycle_node": "actions.lifecycle: LifecycleNode",
        "lifecycle_transition": "actions.lifecycle: LifecycleTransition",
        "load_composable_nodes": "actions.containers: LoadComposableNodes",
        "node": "actions.nodes: Node | NodeActionExtension",
        "push_ros_enclave": "actions.ros_scope: PushRosEnclave",
        "push_ros_namespace": "actions.ros_scope: PushROSNamespace PushRosNamespace",
        "ros_timer": "actions.timers: ROSTimer RosTimer",
        "set_parameter": "actions.ros_scope: SetParameter",
        "set_parameters_from_file": "actions.ros_scope: SetParametersFromFile",
        "set_remap": "actions.ros_scope: SetRemap",
        "set_ros_log_dir": "actions.environment: SetROSLogDir",
        "set_use_sim_time": "actions.ros_scope: SetUseSimTime",
    },
    "launch_ros.descriptions": {
        "": "parameters.descriptions: Parameter ParameterFile ParameterValue",
        "composable_lifecycle_node": "actions.components: ComposableLifecycleNode",
        "composable_node": "actions.components: ComposableNode",
    },
    "launch_ros.event_handlers": {
        "on_state_transition": "actions.lifecycle: OnStateTransition",
    },
    "launch_ros.events": {
        "": "node_names: matches_node_name",
    },
    "launch_ros.events.lifecycle": {
        "change_state": "events.lifecycle: ChangeState",
        "lifecycle_node_matchers": "events.lifecycle: matches_node_name",
        "state_transition": "events.lifecycle: StateTransition",
    },
    "launch_ros.events.matchers": {
        "matches_node_name": "node_names: matches_node_name",
    },
    "launch_ros.substitutions": {
        "executable_in_package": "substitutions.paths: ExecutableInPackage",
        "find_package": "substitutions.paths: FindPackage FindPackagePrefix FindPackageShare",
        "parameter": "substitutions.variables: Parameter",
    },
    "launch_ros.utilities": {
        "evaluate_parameters": "parameters.evaluate: evaluate_parameters | evaluate_parameter_dict",
        "namespace_utils": (
            "node_names: is_namespace_absolute is_root_namespace make_namespace_absolute prefix_namespace"
        ),
        "normalize_parameters": "parameters.normalize: normalize_parameters | normalize_parameter_dict",
        "normalize_remap_rule": "node_names: normalize_remap_rule normalize_remap_rules",
        "plugin_support": "actions.nodes: | PluginException satisfies_version",
        "to_parameters_list": "parameters.of_node: to_parameters_list",
        "track_node_names": "node_names: add_node_name get_node_name_count",
    },
    "launch_xml": {
        "entity": "markup.xml: Entity",
        "parser": "markup.xml: Parser",
    },
    "launch_xml.launch_description_sources": {
        "xml_launch_description_source": "sources: XMLLaunchDescriptionSource",
    },
    "launch_yaml": {
        "entity": "markup.yaml: Entity",
        "parser": "markup.yaml: Parser",
    },
    "launch_yaml.launch_description_sources": {
        "yaml_launch_description_source": "sources: YAMLLaunchDescriptionSource",
    },
    "lifecycle_msgs": {
        "msg": "lifecycle_msgs: | State Transition TransitionEvent",
    },
    "launch_param_builder": {
        "launch_param_builder": "stand_ins.launch_param_builder: ParameterBuilder",
        "utils": (
            "stand_ins.launch_param_builder: ParameterBuilderFileNotFoundError ParameterValueType get_path "
            "load_file load_xacro load_yaml raise_if_file_not_found"
        ),
    },
    "moveit_configs_utils": {
        "launch_utils": "stand_ins.moveit_launches: | DeclareBooleanLaunchArg add_debuggable_node",
        "launches": (
            "stand_ins.moveit_launches: | DeclareBooleanLaunchArg add_debuggable_node generate_demo_launch "
            "generate_move_group_launch generate_moveit_rviz_launch generate_rsp_launch "
            "generate_setup_assistant_launch generate_spawn_controllers_launch "
            "generate_static_virtual_joint_tfs_launch generate_warehouse_db_launch"
        ),
        "moveit_configs_builder": (
            "stand_ins.moveit_configs: MoveItConfigs MoveItConfigsBuilder | get_pattern_matches"
        ),
    },
    "moveit_configs_utils.substitutions": {
        "xacro": "stand_ins.moveit_configs: Xacro",
    },
    "nav2_common": {},
    "nav2_common.launch": {
        "has_node_params": "stand_ins.nav2_common: HasNodeParams",
        "launch_config_as_bool": "stand_ins.nav2_common: LaunchConfigAsBool",
        "replace_string": "stand_ins.nav2_common: ReplaceString",
        "rewritten_yaml": "stand_ins.nav2_common: RewrittenYaml",
    },
    "rclpy": {
        "logging": "stand_ins.rclpy_logging: | LoggingSeverity get_logger get_logger_effective_level set_logger_level",
    },
    "xacro": {
        "": "stand_ins.xacro: parse process_doc process_file",
    },
}

# Names that a package has only from a feature on; the module below it always has them.
GATES: dict[str, Since] = {
    "AllSubstitution": Feature.EQUALS_IF,
    "AnySubstitution": Feature.EQUALS_IF,
    "ComposableLifecycleNode": Feature.LIFECYCLE_AUTOSTART,
    "DeclareBooleanLaunchArgument": Feature.DECLARE_BOOLEAN,
    "EqualsSubstitution": Feature.EQUALS_IF,
    "FileContent": Feature.FILE_CONTENT,
    "ForEach": Feature.FOR_EACH,
    "ForEachVar": Feature.FOR_EACH,
    "ForLoop": Feature.FOR_LOOP,
    "ForLoopIndex": Feature.FOR_LOOP,
    "IfElseSubstitution": Feature.EQUALS_IF,
    "LaunchLogDir": Feature.LAUNCH_LOG_DIR,
    "LifecycleTransition": Feature.LIFECYCLE_TRANSITION,
    "Log": Feature.LOG_LEVEL_ACTIONS,
    "LogDebug": Feature.LOG_LEVEL_ACTIONS,
    "LogError": Feature.LOG_LEVEL_ACTIONS,
    "LogWarning": Feature.LOG_LEVEL_ACTIONS,
    "NotEqualsSubstitution": Feature.EQUALS_IF,
    "PathSubstitution": Feature.PATH_JOIN_OPERATOR,
    "PushROSNamespace": Feature.CAPITAL_ROS_NAMES,
    "ROSTimer": Feature.CAPITAL_ROS_NAMES,
    "ReplaceEnvironmentVariables": Feature.REPLACE_ENVIRONMENT,
    "SetROSLogDir": Feature.SET_ROS_LOG_DIR,
    "SomeEntitiesType": Feature.SOME_ENTITIES_TYPE,
    "SomeEntitiesType_types_tuple": Feature.SOME_ENTITIES_TYPE,
    "StringJoinSubstitution": Feature.STRING_JOIN,
}
