//! The window: menus, actions, pane layout, and the stored state.

pub(crate) mod actions;
pub(crate) mod app;
pub(crate) mod menu;
pub(crate) mod problems;
pub(crate) mod state;
pub(crate) mod theme;
pub(crate) mod toasts;
