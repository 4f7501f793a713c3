#pragma once

namespace scanrig {

/// The calling thread, and those that it starts from now on, run when no other thread of the machine wants to: work of
/// seconds beside work of milliseconds. For good: raising a priority again takes a privilege. Loops that such a thread
/// runs in with_threads() give way with it. On Linux a thread has a nice value of its own (sched(7)).
void lower_priority();

/// How far the calling thread gives way (its nice value); 0: not at all.
int niceness();
/// The calling thread gives way at least so far, from now on.
void give_way_by(int niceness);

}  // namespace scanrig
