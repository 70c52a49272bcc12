mod batches;
mod proximity;
pub mod resolution_policy;
mod row_check;
