#include "machine/moonraker/link/connection.h"

#include <fmt/format.h>

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/thread_priority.h"
#include "machine/moonraker/link/link.h"

namespace trammel::machine {

namespace asio = boost::asio;

namespace {

/// A hanging printer must not delay the program's end; a busy computer needs time.
constexpr std::chrono::milliseconds kLastWords{2000};

}  // namespace

struct MoonrakerConnection::State {
  State(MoonrakerAddress the_address, MoonrakerOptions the_options, ConnectionEvents the_events)
      : address(std::move(the_address)),
        options(std::move(the_options)),
        events(std::move(the_events)) {}

  void CloseLink() {
    up = false;
    queued_bytes -= std::exchange(link_bytes, 0);
    if (link) {
      link->Close();
      link.reset();
    }
  }

  /// Waits until all texts passed to Send are sent and read by the peer, or there is no progress
  /// for so long. No more events follow. REQUIRES another thread than the link's.
  void Finish(std::chrono::milliseconds most) {
    ending = true;
    FlushFor(most);
    asio::post(io, [this] {
      if (up && link_bytes == 0) {
        link->Finish();
      } else {
        up = false;
      }
    });
    const auto end = std::chrono::steady_clock::now() + most;
    while (up && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  /// Waits until all texts passed to Send are sent, or there is no progress for so long.
  void FlushFor(std::chrono::milliseconds most) const {
    using Clock = std::chrono::steady_clock;
    std::size_t left = queued_bytes;
    auto end = Clock::now() + most;
    while (up && left > 0 && Clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (queued_bytes < left) end = Clock::now() + most;
      left = queued_bytes;
    }
  }

  /// Handles events until the context is stopped. An exception in a handler ends the link, like a
  /// peer that disconnects, and not the process.
  void Serve() {
    RaiseThisThread(ThreadUrgency::kWorking);  // its queries bracket the printer's clock
    while (const std::optional<std::string> bug = NoteBug([this] { io.run(); })) {
      if (!link) continue;
      asio::post(io, [this, bug] {
        if (!link) return;
        CloseLink();
        if (ending) return;
        events.on_down(
            {ErrorKind::kMachine, fmt::format("a bug in trammel ended the connection to {}: {}",
                                              address.WebSocketUrl(), *bug)});
      });
    }
  }

  LinkEvents EventsForLink() {
    LinkEvents link_events;
    link_events.on_open = [this] {
      up = true;
      if (!ending) events.on_open();
    };
    link_events.on_message = [this](std::string_view message) {
      if (ending) return;
      log.Add(MessageDirection::kIn, message);
      events.on_message(message);
    };
    link_events.on_down = [this](Error error) {
      CloseLink();
      if (!ending) events.on_down(std::move(error));
    };
    link_events.on_written = [this](std::size_t bytes) {
      queued_bytes -= bytes;
      link_bytes -= bytes;
    };
    return link_events;
  }

  const MoonrakerAddress address;
  const MoonrakerOptions options;
  const ConnectionEvents events;
  MessageLog log;
  asio::io_context io;
  asio::executor_work_guard<asio::io_context::executor_type> keep_running = make_work_guard(io);
  std::atomic<bool> up = false;
  std::atomic<bool> ending = false;
  std::atomic<std::size_t> queued_bytes = 0;  ///< given to Send and not yet written or dropped
  // Used on the I/O thread only.
  std::shared_ptr<MoonrakerLink> link;
  std::size_t link_bytes = 0;  ///< those of queued_bytes that the link has
  std::thread thread;
};

MoonrakerConnection::MoonrakerConnection(MoonrakerAddress address, MoonrakerOptions options,
                                         ConnectionEvents events)
    : state_(std::make_unique<State>(std::move(address), std::move(options), std::move(events))) {
  state_->thread = std::thread([state = state_.get()] { state->Serve(); });
}

MoonrakerConnection::~MoonrakerConnection() {
  state_->Finish(kLastWords);
  state_->io.stop();
  state_->thread.join();
  state_->CloseLink();
}

void MoonrakerConnection::Connect() {
  asio::post(state_->io, [state = state_.get()] {
    state->CloseLink();
    state->link = MakeLink(state->io, state->address, state->options, state->EventsForLink());
    state->link->Open();
  });
}

void MoonrakerConnection::Drop(Error error) {
  asio::post(state_->io, [state = state_.get(), error = std::move(error)] {
    if (state->link) {
      state->CloseLink();
      state->events.on_down(error);
    }
  });
}

Result<void> MoonrakerConnection::Send(std::string message) {
  if (!state_->up) {
    return Fail(fmt::format("there is no connection to {}", state_->address.WebSocketUrl()),
                ErrorKind::kMachine);
  }
  const std::size_t bytes = message.size();
  if (state_->queued_bytes + bytes > kMaxMessageBytes) {
    return Fail(
        fmt::format("{} does not read what we send: {} bytes wait already, {} more would be too "
                    "many; check the network and the load of the printer's computer",
                    state_->address.WebSocketUrl(), state_->queued_bytes.load(), bytes),
        ErrorKind::kMachine);
  }
  state_->queued_bytes += bytes;
  asio::post(state_->io, [state = state_.get(), text = std::move(message)]() mutable {
    if (state->up && state->link) {
      state->link_bytes += text.size();
      state->log.Add(MessageDirection::kOut, text);
      state->link->Write(std::move(text));
    } else {
      state->queued_bytes -= text.size();
    }
  });
  return {};
}

void MoonrakerConnection::RunAfter(double delay_s, std::function<void()> function) {
  auto timer = std::make_shared<asio::steady_timer>(state_->io);
  timer->expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(delay_s)));
  timer->async_wait(
      [timer, function = std::move(function)](const boost::system::error_code& error) {
        if (!error) function();
      });
}

bool MoonrakerConnection::OnOwnThread() const {
  return std::this_thread::get_id() == state_->thread.get_id();
}

const MessageLog& MoonrakerConnection::log() const { return state_->log; }
const MoonrakerAddress& MoonrakerConnection::address() const { return state_->address; }

}  // namespace trammel::machine
