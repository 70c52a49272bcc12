mod proximity;
mod resolution_policy;
mod viewpoints;
