//! The three hosts of `docs/STAGES.md`, as the page says them: its site file and its commands, word by word, in network namespaces.
#![cfg(feature = "node")]

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

mod common;
#[path = "common/command.rs"]
mod command;

use command::{done, umbracast};
use common::folder;

const PAGE: &str = include_str!("../../../docs/STAGES.md");
/// Tries of `fleet` until all is well: a hall needs some seconds to find itself, and a busy machine more.
const TRIES: usize = 30;

/// What stands between a fence of this language and the next fence, of the section on three hosts.
fn blocks(language: &str) -> Vec<&'static str> {
    let (_, section) = PAGE.split_once("\n## A hall of three hosts\n").expect("the section");
    let (section, _) = section.split_once("\n## ").expect("another section");
    let fence = format!("```{language}\n");
    section.split(&fence).skip(1).map(|text| text.split("```").next().unwrap_or_default()).collect()
}

/// The commands of a block, each with the host that it is for.
fn commands(block: &'static str) -> Vec<(&'static str, Ipv4Addr)> {
    let command = |line: &'static str| {
        let (command, host) = line.rsplit_once('#').unwrap_or_else(|| panic!("{line}: no host behind it"));
        (command.trim(), host.trim().parse().expect("an address"))
    };
    block.lines().map(command).collect()
}

/// Network namespaces on one bridge, which has a namespace of its own. They end with their scope.
struct Hosts {
    bridge: String,
    hosts: Vec<(Ipv4Addr, String)>,
    folder: PathBuf,
}

impl Hosts {
    /// None where this system lets nobody make namespaces.
    fn new(addresses: &BTreeSet<Ipv4Addr>, folder: PathBuf) -> Option<Self> {
        let id = std::process::id();
        let hosts = addresses.iter().map(|host| (*host, format!("umbracast-{id}-{}", host.octets()[3])));
        let hosts = Self { bridge: format!("umbracast-{id}-bridge"), hosts: hosts.collect(), folder };
        let bridge = &hosts.bridge;
        if !ip(&format!("netns add {bridge}")) {
            return None;
        }
        assert!(
            ip(&format!("-n {bridge} link add bridge type bridge"))
                && ip(&format!("-n {bridge} link set bridge up"))
        );
        for (k, (address, host)) in hosts.hosts.iter().enumerate() {
            for words in [
                format!("netns add {host}"),
                format!("-n {bridge} link add to{k} type veth peer name wire netns {host}"),
                format!("-n {bridge} link set to{k} master bridge up"),
                format!("-n {host} address add {address}/24 dev wire"),
                format!("-n {host} link set wire up"),
                format!("-n {host} link set lo up"),
            ] {
                assert!(ip(&words), "ip {words}");
            }
        }
        Some(hosts)
    }

    /// A command of the page on one of them.
    fn command(&self, words: &str, host: Ipv4Addr) -> Command {
        let (_, name) = self.hosts.iter().find(|(address, _)| *address == host).expect("a host");
        let words = words.strip_prefix("umbracast ").expect("a command of ours");
        let mut command = Command::new("ip");
        command.args(["netns", "exec", name]).arg(umbracast(&[]).get_program());
        command.args(words.split_whitespace()).current_dir(&self.folder).stdin(Stdio::null());
        command
    }

    /// Runs it until this is dropped.
    fn start(&self, words: &str, host: Ipv4Addr) -> Running {
        let mut child = self.command(words, host).stdout(Stdio::piped()).spawn().expect("starts");
        let said = BufReader::new(child.stdout.take().expect("piped"));
        Running { child, said }
    }

    fn output(&self, words: &str, host: Ipv4Addr) -> Output {
        self.command(words, host).output().expect("starts")
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for (_, host) in &self.hosts {
            ip(&format!("netns delete {host}"));
        }
        ip(&format!("netns delete {}", self.bridge));
    }
}

struct Running {
    child: Child,
    said: BufReader<std::process::ChildStdout>,
}

impl Running {
    /// Its lines until one ends so.
    fn lines_until(&mut self, end: &str) -> Vec<String> {
        let lines = self.said.by_ref().lines().map(|line| line.expect("a line"));
        let mut all = Vec::new();
        for line in lines {
            all.push(line);
            if all.last().is_some_and(|line| line.ends_with(end)) {
                return all;
            }
        }
        panic!("ended before {end:?}: {all:?}");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn ip(words: &str) -> bool {
    let output = Command::new("ip").args(words.split_whitespace()).output();
    output.is_ok_and(|output| output.status.success())
}

#[test]
fn the_three_hosts_of_the_page_on_stages_work_as_it_says_and_fleet_finds_nothing_wrong() {
    let [site] = blocks("toml")[..] else { panic!("one site file") };
    let [nodes, look] = blocks("sh")[..] else { panic!("nodes, and how to look at them") };
    let (nodes, look) = (commands(nodes), commands(look));
    let addresses = nodes.iter().map(|(_, host)| *host).collect();
    let folder = folder("stages-page");
    let Some(hosts) = Hosts::new(&addresses, folder.clone()) else {
        println!("skipped: this system lets nobody make network namespaces");
        return;
    };
    assert_eq!(addresses.len(), 3);
    done(&["simulate", "--people", "2", "--out", folder.join("sim").to_str().expect("a plain name")]);
    fs::rename(folder.join("sim/empty.mcap"), folder.join("empty.mcap")).expect("the empty hall");
    fs::write(folder.join("hall.toml"), site).expect("writes");

    let mut running: Vec<Running> = nodes.iter().map(|(command, host)| hosts.start(command, *host)).collect();
    for (node, (command, _)) in running.iter_mut().zip(&nodes) {
        let lines = node.lines_until("ready");
        assert!(!lines.iter().any(|line| line == "UDP port 0"), "{command}: {lines:?}");
    }
    // People walk, and the sensors send to the host that the front ends are on.
    let (_, edge) = nodes.last().expect("front ends");
    let packets = "umbracast simulate --people 10 --stroll 600 --packets udp:127.0.0.1:2368 --quiet";
    running.push(hosts.start(packets, *edge));

    let (command, host) = look[0];
    let mut said = String::new();
    let well = (0..TRIES).any(|_| {
        let output = hosts.output(command, host);
        said = String::from_utf8_lossy(&output.stdout).into_owned();
        let well = output.status.code() == Some(0);
        if !well {
            std::thread::sleep(Duration::from_millis(500));
        }
        well
    });
    assert!(well, "{said}");
    for (stage, count) in [("forecast,track", 1), ("cast", 1), ("sensor", 2)] {
        let of_stage = |line: &&str| line.split_whitespace().nth(2) == Some(stage);
        assert_eq!(said.lines().filter(of_stage).count(), count, "{stage}: {said}");
    }

    // A caster that hangs is missed: first it says nothing, then it is gone.
    let caster = nodes.iter().position(|(command, _)| command.contains(" cast ")).expect("a caster");
    let pid = running[caster].child.id().to_string();
    assert!(Command::new("kill").args(["-STOP", &pid]).status().expect("kill").success());
    let told = (0..TRIES).any(|_| {
        let output = hosts.output(command, host);
        said = String::from_utf8_lossy(&output.stdout).into_owned();
        output.status.code() == Some(1) && said.contains("no node runs cast: nobody warns")
    });
    assert!(told, "{said}");
}
