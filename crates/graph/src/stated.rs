//! What a file states of a node, before anything runs.

use crate::{
    graph::Instance,
    job::{InputValue, Job},
    node::{Fallback, Node},
    param::ParamValues,
};

/// What an input has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feed {
    /// A wire.
    Wire,
    /// A number, that of the file or the default.
    Number(f64),
    /// Nothing.
    Nothing,
}

/// The parameters of a node and what its inputs have: enough to refuse combinations that cannot be computed
/// ([`Node::refuses`]).
#[derive(Clone, Debug)]
pub struct Stated<'a> {
    node: &'a Node,
    /// Its parameters.
    pub params: &'a ParamValues,
    feeds: Vec<Feed>,
}

impl<'a> Stated<'a> {
    /// A node of a graph; `is_wired` says which of its inputs have a wire.
    #[must_use]
    pub fn of_instance(instance: &'a Instance, is_wired: impl Fn(usize) -> bool) -> Self {
        let feed = |input: usize| match (is_wired(input), instance.node.inputs[input].fallback) {
            (true, _) => Feed::Wire,
            (_, Fallback::Constant { default, .. }) => {
                let given = instance.constants.get(input).copied().flatten();
                Feed::Number(given.unwrap_or(default))
            }
            _ => Feed::Nothing,
        };
        Self {
            node: instance.node,
            params: &instance.params,
            feeds: (0..instance.node.inputs.len()).map(feed).collect(),
        }
    }

    /// The node of a job.
    #[must_use]
    pub fn of_job(job: &'a Job<'_>) -> Self {
        let feed = |input: &InputValue| match input {
            InputValue::Value(_) => Feed::Wire,
            InputValue::Constant(number) => Feed::Number(*number),
            InputValue::Absent => Feed::Nothing,
        };
        Self { node: job.node, params: job.params, feeds: job.inputs.iter().map(feed).collect() }
    }

    /// What the input of this name has; nothing if there is none.
    #[must_use]
    pub fn feed(&self, input: &str) -> Feed {
        let position = self.node.inputs.iter().position(|declared| declared.name == input);
        position.and_then(|position| self.feeds.get(position)).copied().unwrap_or(Feed::Nothing)
    }
}
