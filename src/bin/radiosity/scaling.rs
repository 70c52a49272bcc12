//! `radiosity scaling`: how long a run would take on many processes.

use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::work::{Cluster, Costs, processes, with_costs};
use radiosity::{Error, ErrorKind};

use crate::args::{List, Stop, list, value, write_file};

/// Says how long a run would take on many processes, by the costs of its tasks
#[derive(Args)]
#[command(after_help = "\
  radiosity bake HALL.obj --error 0.02 --cpu --costs hall.costs.json
  radiosity scaling hall.costs.json

Each process has as many threads as the run that wrote the costs. Columns: processes; seconds; \
efficiency, 1 where N processes take an Nth of the time of one; of the seconds those of shared \
work, of work that every process does, of waiting for the slowest, of exchanging results.")]
pub struct Options {
    /// Costs, of a command's `--costs FILE`
    #[arg(value_name = "COSTS.json")]
    file: PathBuf,
    /// Numbers of processes
    #[arg(long, value_name = "N,…", default_value = "1,2,4,16,64,256,1024,4096",
        value_parser = list::<usize>("numbers of processes, such as 1,2,4"))]
    processes: List<usize>,
    /// Seconds from process to process
    #[arg(long, value_name = "SECONDS", default_value_t = 2e-6,
        value_parser = value::<f64>("seconds, such as 2e-6"))]
    latency: f64,
    /// Bytes that a process receives in a second
    #[arg(long, value_name = "BYTES", default_value_t = 1e10,
        value_parser = value::<f64>("bytes in a second, such as 1e10"))]
    bandwidth: f64,
    /// Processes that run at once, while others wait [default: all]
    #[arg(long, value_name = "N", value_parser = value::<usize>("a number of processes"))]
    at_once: Option<usize>,
    /// Items in each loop, and all that is not shared, as many times
    #[arg(long, value_name = "K", default_value_t = 1,
        value_parser = value::<usize>("how many times as large the scene is, such as 10"))]
    times: usize,
}

impl Options {
    /// Runs the command.
    pub fn run(self) -> Result<(), Stop> {
        let positive = [
            ("--processes", self.processes.iter().all(|&processes| processes > 0)),
            ("--latency", self.latency >= 0.0 && self.latency.is_finite()),
            ("--bandwidth", self.bandwidth > 0.0),
            ("--at-once", self.at_once != Some(0)),
            ("--times", self.times > 0),
        ];
        if let Some((option, _)) = positive.iter().find(|(_, holds)| !holds) {
            return Err(Stop::usage(format!("{option}: give positive numbers")));
        }
        let costs = read(&self.file)?;
        let cluster = |processes| Cluster {
            processes,
            latency: self.latency,
            bandwidth: self.bandwidth,
            at_once: self.at_once,
        };
        let alone = costs.simulate(&cluster(1), self.times).total();
        say!("{} threads a process", costs.threads);
        say!("processes    seconds  efficiency     shared        own    waiting   exchange");
        for &processes in &self.processes {
            let time = costs.simulate(&cluster(processes), self.times);
            let seconds = time.total();
            let efficiency = alone / seconds / processes as f64;
            say!(
                "{processes:>9} {seconds:>10.2} {efficiency:>11.3} {:>10.2} {:>10.2} {:>10.2} \
                 {:>10.2}",
                time.shared,
                time.own,
                time.waiting,
                time.exchange
            );
        }
        Ok(())
    }
}

fn read(path: &Path) -> Result<Costs, Error> {
    let wrong = |found: String| {
        let remedy = "give a file that a command has written by --costs";
        Error::new(ErrorKind::File, path.display().to_string(), found, remedy)
    };
    let bytes = std::fs::read(path).map_err(|error| wrong(error.to_string()))?;
    serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))
}

/// Runs a command, and writes what its tasks cost.
pub fn recorded(path: &Path, work: impl FnOnce() -> Result<(), Stop>) -> Result<(), Stop> {
    if processes() > 1 {
        return Err(Stop::usage("--costs: what tasks cost is recorded in one process"));
    }
    let (done, costs) = with_costs(work);
    write_file(path, &serde_json::to_vec(&costs).expect("numbers have a form in JSON"));
    done
}
