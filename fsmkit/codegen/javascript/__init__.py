"""The target `javascript`: a chart as a module of ECMAScript 2020."""
