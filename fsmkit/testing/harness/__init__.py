"""Every runtime under the same script: `fsmkit run`, conformance suites, the differential test."""
