#pragma once

namespace scanrig {

/// A visitor made of lambdas.
template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};

}  // namespace scanrig
