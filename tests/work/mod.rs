mod journal;
mod processes;
