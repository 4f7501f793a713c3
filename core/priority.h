#pragma once

namespace scanrig {

/// Lowers the priority of the calling thread and of those that it starts from now on, for work of seconds beside work
/// of milliseconds. They run when no other thread of the machine needs the processor. Permanent: raising a priority
/// again takes a privilege. Loops in with_threads() of such a thread take its priority. On Linux a thread has its own
/// nice value (sched(7)).
void lower_priority();

/// Nice value of the calling thread; 0: normal priority.
int niceness();
/// Lowers the calling thread at least to `nice`, from now on.
void lower_priority_to(int nice);

}  // namespace scanrig
