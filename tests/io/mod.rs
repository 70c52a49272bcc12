mod files;
mod obj;
