//! Plans the fastest point-to-point move of a flexible machine that ends still, checks it, and writes it in the
//! form that the motion-controller board plays.
#![cfg_attr(not(feature = "ipopt"), forbid(unsafe_code))]
#![cfg_attr(feature = "ipopt", deny(unsafe_code))]

pub mod autodiff;
pub mod baseline;
pub mod benchmarks;
pub mod certify;
pub mod cli;
pub mod device;
pub mod machine;
pub mod movefile;
pub mod nlp;
pub mod ocp;
pub mod plan;
pub mod report;
pub mod simulate;
pub mod sptfile;
pub mod study;
