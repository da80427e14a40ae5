//! The services by which a node's parameters are looked at and set.

use bus::message::MissionRecord;
use ros2_client::ParameterValue;
use ros2_client::builtin_interfaces;
use ros2_client::parameters::raw::{Parameter, ParameterEvent, SetParametersResult};
use ros2_client::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, ListParametersResult, SetParametersAtomicallyResponse, SetParametersRequest,
    SetParametersResponse,
};

use crate::node::{Node, NodeError, Saying, Service, Voice};
use crate::parameters::{Change, ParameterError, Parameters};

/// The parameters, and whoever answers for them.
pub(super) struct Services {
    pub(super) parameters: Parameters,
    /// As the run was started.
    alpha: f64,
    /// Changes of alpha that the mission has not answered yet.
    n_asked: usize,
    get: Service<GetParametersRequest, GetParametersResponse>,
    types: Service<GetParameterTypesRequest, GetParameterTypesResponse>,
    set: Service<SetParametersRequest, SetParametersResponse>,
    set_all: Service<SetParametersRequest, SetParametersAtomicallyResponse>,
    list: Service<ListParametersRequest, ListParametersResponse>,
    describe: Service<DescribeParametersRequest, DescribeParametersResponse>,
    events: Option<Voice<ParameterEvent>>,
    node: String,
}

impl Services {
    pub(super) fn new(node: &mut Node, parameters: Parameters) -> Result<Self, NodeError> {
        Ok(Self {
            alpha: parameters.alpha,
            parameters,
            n_asked: 0,
            get: node.serve("get_parameters", "GetParameters")?,
            types: node.serve("get_parameter_types", "GetParameterTypes")?,
            set: node.serve("set_parameters", "SetParameters")?,
            set_all: node.serve("set_parameters_atomically", "SetParametersAtomically")?,
            list: node.serve("list_parameters", "ListParameters")?,
            describe: node.serve("describe_parameters", "DescribeParameters")?,
            events: node.speak("/parameter_events", Saying::Passing)?,
            node: node.full_name().to_owned(),
        })
    }

    /// Answers whoever asks, and returns what was set.
    pub(super) fn answer(&mut self, stamp_ns: i64) -> Result<Vec<Change>, NodeError> {
        let known = self.parameters.clone();
        self.get.answer(|asked| GetParametersResponse {
            values: asked.names.iter().map(|name| known.value(name).into()).collect(),
        });
        self.types.answer(|asked| GetParameterTypesResponse {
            values: asked.names.iter().map(|name| type_of(&known, name)).collect(),
        });
        self.list.answer(|asked| ListParametersResponse {
            result: ListParametersResult { names: known.list(&asked.prefixes), prefixes: Vec::new() },
        });
        self.describe.answer(|asked| DescribeParametersResponse {
            values: asked.names.iter().map(|name| known.describe(name)).collect(),
        });
        let (mut changes, parameters) = (Vec::new(), &mut self.parameters);
        let mut set = |told: &[Parameter]| {
            let wanted = told.iter().map(|told| parameters.change(&told.name, &value_of(told)));
            let wanted = wanted.collect::<Result<Vec<_>, ParameterError>>()?;
            wanted.iter().for_each(|change| parameters.apply(*change));
            changes.extend(told.iter().cloned().zip(wanted));
            Ok(())
        };
        self.set.answer(|asked| SetParametersResponse {
            results: asked.parameter.iter().map(|told| result(set(std::slice::from_ref(told)))).collect(),
        });
        self.set_all
            .answer(|asked| SetParametersAtomicallyResponse { result: result(set(&asked.parameter)) });
        self.tell(changes, stamp_ns)
    }

    /// Follows the mission, which anybody may have told another share of outcomes.
    pub(super) fn follow(&mut self, mission: &MissionRecord) {
        if self.n_asked == 0 {
            self.parameters.alpha = if mission.alpha > 0.0 { mission.alpha } else { self.alpha };
        }
    }

    /// The mission has been asked for another share of outcomes.
    pub(super) fn note_asked(&mut self) {
        self.n_asked += 1;
    }

    /// It has answered.
    pub(super) fn note_answered(&mut self) {
        self.n_asked = self.n_asked.saturating_sub(1);
    }

    fn tell(&self, changes: Vec<(Parameter, Change)>, stamp_ns: i64) -> Result<Vec<Change>, NodeError> {
        let (changed_parameters, changes): (Vec<_>, Vec<_>) = changes.into_iter().unzip();
        if let Some(voice) = self.events.as_ref().filter(|_| !changes.is_empty()) {
            voice.say(ParameterEvent {
                stamp: builtin_interfaces::Time::from_nanos(stamp_ns),
                node: self.node.clone(),
                new_parameters: Vec::new(),
                changed_parameters,
                deleted_parameters: Vec::new(),
            })?;
        }
        Ok(changes)
    }
}

fn value_of(told: &Parameter) -> ParameterValue {
    told.value.clone().into()
}

fn type_of(parameters: &Parameters, name: &str) -> u8 {
    ParameterValue::to_parameter_type_raw(&parameters.value(name))
}

fn result(set: Result<(), ParameterError>) -> SetParametersResult {
    let reason = set.as_ref().err().map_or_else(String::new, ToString::to_string);
    SetParametersResult { successful: set.is_ok(), reason }
}
