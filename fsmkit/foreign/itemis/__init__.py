"""The reader of statecharts of itemis CREATE, formerly YAKINDU Statechart Tools."""
