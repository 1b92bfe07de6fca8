// For headers that only name CLI11's types: its own header takes 4 s to compile, 8 s under the sanitizers.
#pragma once

namespace CLI {
class App;
class Option;
}  // namespace CLI
