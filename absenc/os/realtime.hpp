// SPDX-License-Identifier: Apache-2.0
// Real-time scheduling of threads that must be punctual.
#pragma once

namespace absenc::os {

inline constexpr int lowest_realtime = 1;
inline constexpr int highest_realtime = 99;

/// Makes the calling thread a real-time thread (SCHED_FIFO) of at least `priority`, 1 to 99, until it ends; threads
/// and processes that it starts are not real-time. Also locks the memory of the process: the pages mapped now, and
/// each later page when it is used. Throws Failure of kind `no_permission` if the kernel refuses the priority or the
/// lock, or of kind `system`; then neither is changed.
void require_realtime(int priority);

}  // namespace absenc::os
