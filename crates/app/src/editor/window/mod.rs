//! The window: menus, actions, input, pane layout, and the stored state.

pub(crate) mod actions;
pub(crate) mod app;
mod cells;
mod history;
mod input;
pub(crate) mod menu;
mod menus;
pub(crate) mod names;
pub(crate) mod problems;
pub(crate) mod state;
pub(crate) mod theme;
pub(crate) mod toasts;
