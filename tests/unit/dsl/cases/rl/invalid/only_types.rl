// expect: SW002
type Float
