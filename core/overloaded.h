#pragma once

namespace touchstone {

/// Lambdas as one function for std::visit: Overloaded{[](const A&) {...}, [](const B&) {...}}.
template <typename... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <typename... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

}  // namespace touchstone
