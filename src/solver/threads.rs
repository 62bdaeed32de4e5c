//! Members on threads of this process, a device each.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use super::exchange::{Meeting, Seat, other_failed};
use super::member::Member;
use super::messages::{Command, MemberData, MemberShare, Reply};
use super::team::Others;
use crate::error::Result;
use crate::vk::Device;

/// See the module.
pub(super) struct Threads {
    meeting: Arc<Meeting>,
    members: Vec<OnThread>,
}

struct OnThread {
    commands: Sender<Command>,
    replies: Receiver<Result<Reply>>,
    thread: Option<JoinHandle<()>>,
}

impl Threads {
    /// Each answers when it is made.
    pub fn start(
        devices: &[Arc<Device>],
        data: &Arc<MemberData>,
        own: Vec<MemberShare>,
        meeting: &Arc<Meeting>,
    ) -> Self {
        let start = |((m, device), own): ((usize, &Arc<Device>), MemberShare)| {
            let (commands, asked) = channel();
            let (answers, replies) = channel();
            let (device, data) = (Arc::clone(device), Arc::clone(data));
            let seat = meeting.seat(1 + m);
            let work = move || work(&device, data, own, seat, &asked, &answers);
            OnThread {
                commands,
                replies,
                thread: Some(thread::spawn(work)),
            }
        };
        let members = devices.iter().enumerate().zip(own);
        Self {
            meeting: Arc::clone(meeting),
            members: members.map(start).collect(),
        }
    }
}

/// Answers until nothing is asked any more, or something has failed.
fn work(
    device: &Arc<Device>,
    data: Arc<MemberData>,
    own: MemberShare,
    seat: Seat,
    asked: &Receiver<Command>,
    answers: &Sender<Result<Reply>>,
) {
    let made = Member::new(device, &data, own, Some(Box::new(seat)));
    drop(data);
    let mut member = match made {
        Ok(member) => member,
        Err(error) => return drop(answers.send(Err(error))),
    };
    let mut answer = Some(Ok(Reply::Done));
    loop {
        let is_asked = match answer.take() {
            Some(answer) => answers.send(answer).is_ok(),
            None => true,
        };
        if !is_asked {
            return;
        }
        let Ok(command) = asked.recv() else {
            return;
        };
        let is_answered = command.is_answered();
        match member.run(command) {
            Ok(reply) => answer = is_answered.then_some(Ok(reply)),
            Err(error) => {
                // Its place is left first, so that nobody waits for it.
                drop(member);
                return drop(answers.send(Err(error)));
            }
        }
    }
}

impl Others for Threads {
    fn ask(&mut self, commands: Vec<Command>) -> Result<()> {
        for (member, command) in self.members.iter().zip(commands) {
            // Why it has ended is among the answers.
            let _ = member.commands.send(command);
        }
        Ok(())
    }

    fn ask_all(&mut self, command: &Command) -> Result<()> {
        self.ask(vec![command.clone(); self.members.len()])
    }

    fn answers(&mut self) -> Vec<Result<Reply>> {
        let answer = |member: &OnThread| {
            let answer = member.replies.recv();
            answer.unwrap_or_else(|_| Err(other_failed()))
        };
        self.members.iter().map(answer).collect()
    }

    fn close(&mut self) {
        self.meeting.close();
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.meeting.close();
        for member in self.members.drain(..) {
            drop(member.commands);
            if let Some(thread) = member.thread {
                // What ended it was reported where its answers were awaited.
                let _ = thread.join();
            }
        }
    }
}
