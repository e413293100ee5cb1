#pragma once

namespace touchstone {

/// Lambdas as one function for std::visit: Overloaded{[](const A&) {...}, [](const B&) {...}}.
template <typename... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
/// Its types are those of the lambdas.
template <typename... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

}  // namespace touchstone
