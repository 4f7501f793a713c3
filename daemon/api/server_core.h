#pragma once

#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <memory>

#include "daemon/api/access.h"
#include "daemon/api/admission.h"
#include "daemon/api/event_hub.h"
#include "daemon/api/route.h"
#include "daemon/api/server.h"

namespace scanrig {

/// State shared by all connections. Outlives them.
struct ServerCore {
  ServerCore(ApiStation what, PeerRoles peers, Proxy in_front, const ApiOptions& options, std::string life)
      : station(std::move(what)),
        access(peers, options.tokens),
        proxy(std::move(in_front)),
        limits(options.limits),
        journal(options.journal),
        admission(std::make_shared<Admission>(options.limits)),
        hub(std::move(life)) {}

  const Router router;
  const ApiStation station;
  Access access;
  const Proxy proxy;
  const ApiLimits limits;
  const std::function<void(JournalEntry)> journal;
  const std::shared_ptr<Admission> admission;
  EventHub hub;
  std::atomic<std::uint64_t> requests = 0, refused = 0;
  const std::shared_ptr<int> answers = std::make_shared<int>();  ///< one more owner for every reply on its way out
  boost::asio::thread_pool workers{2};                           ///< for work that touches the disk
};

}  // namespace scanrig
