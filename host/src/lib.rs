//! Plans the fastest point-to-point move of a flexible machine that ends still, checks it, and writes it in the
//! form that the motion-controller board plays.
#![forbid(unsafe_code)]

pub mod autodiff;
pub mod machine;
pub mod movefile;
pub mod report;
