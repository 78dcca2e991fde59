//! How much scripts may take: time, memory, messages.

use serde::{Deserialize, Serialize};

/// The budgets of a runtime. What is over is refused, dropped or done in the next step, and told.
///
/// Operations are Rhai's: roughly a node of an expression, a statement or a call. They are the same on every machine; the two
/// wall clocks are for what one operation can hide (sorting a list) and for slow machines, and come after them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Operations that a handler may take. More lets handlers do more at once, and lets a bad one stall a frame for longer.
    pub handler_operations: u64,
    /// Operations that the top level of a script may take when it starts.
    pub start_operations: u64,
    /// Operations after which a step leaves what is still queued to the next.
    pub step_operations: u64,
    /// Milliseconds after which a step leaves what is still queued to the next; `None`: the same on every machine.
    pub step_ms: Option<u32>,
    /// Milliseconds after which a single handler is ended. What a handler may do in its operations takes a few; a machine that does other things as well may keep it waiting
    /// for tens, and a story whose welcome is ended does not go on.
    pub handler_ms: Option<u32>,
    /// Functions that call one another: each takes stack.
    pub call_depth: usize,
    /// Variables of one function.
    pub variables: usize,
    /// Bytes of a text, and of all texts in a list together. Times the operations of a handler it bounds what one can hold at a
    /// time: Rhai does not measure a `#{ ... }` that grows by an index, so that some tens of MiB are gone only when it ends.
    pub text_bytes: usize,
    /// Entries of a list, those of lists in it counted with it.
    pub list_entries: usize,
    /// Entries of a `#{ ... }`, counted likewise.
    pub table_entries: usize,
    /// Bytes of a script's `state`, as [`Value::weight`](crate::value::Value::weight) counts them.
    pub state_bytes: usize,
    /// Bytes of what one message carries.
    pub message_bytes: usize,
    /// Events that wait for one script; what comes then is dropped.
    pub queue: usize,
    /// Messages that one script may send in a step.
    pub messages: usize,
    /// Actions that one script may ask for in a step.
    pub actions: usize,
    /// Handlers that one script may have.
    pub handlers: usize,
    /// Timers that one script may have.
    pub timers: usize,
    /// Things that are told of one script in a step: failures, `print`.
    pub notes: usize,
    /// Failures within a minute after which a script is switched off.
    pub failures: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            handler_operations: 50_000,
            start_operations: 500_000,
            step_operations: 200_000,
            step_ms: Some(4),
            handler_ms: Some(100),
            call_depth: 24,
            variables: 128,
            text_bytes: 8 * 1024,
            list_entries: 2048,
            table_entries: 1024,
            state_bytes: 256 * 1024,
            message_bytes: 8 * 1024,
            queue: 1024,
            messages: 128,
            actions: 512,
            handlers: 512,
            timers: 128,
            notes: 16,
            failures: 10,
        }
    }
}

impl Limits {
    /// Without clocks: the same events make the same actions on every machine, however slow. For tests and recordings.
    #[must_use]
    pub fn deterministic() -> Self {
        Self { step_ms: None, handler_ms: None, ..Self::default() }
    }
}
