// expect: SW090 SW091 SW091 SW093 SW097 SW096 SW096
/* Every construct of the dialect, each in its single form and as a block. */
type Float
type {
    Image
    bool
    String
}

skillset everything {
    type Int
    parameter fence: Float
    data battery: Float period 2.5
    data {
        picture: Image
        speed:   Float period 1 sec
        count:   Int   period 250 ms
        ready:   bool
    }

    resource motion {
        state { Free Used None }
        initial Free
        transition all
    }
    resource {
        lamp {
            state { Off On Broken }
            initial Off
            transition {
                Off -> On
                On  -> Off
                On  -> Broken
                Broken -> On
            }
        }
        weather {
            state { Dry Wet }
            initial Dry
            transition all
        }
    }

    event lamp_breaks {
        guard  lamp == On and true
        effect lamp -> Broken
    }
    event {
        freed { effect { motion -> Free } }
    }

    skill inspect {
        parameter patience: Float
        input place: String
        output {
            picture: Image
            label:   String
        }
        precondition free: motion == Free
        precondition dry: weather != Wet
        start {
            motion -> Used
            lamp -> On
        }
        invariant dry {
            guard weather == Dry => not (motion == Free)
            effect motion -> Free
        }
        progress {
            period 500 ms
            message {
                done: Float
                left: Int
            }
        }
        interrupt {
            interrupting true
            postcondition weather == Dry
            effect {
                motion -> Free
                lamp -> Off
            }
        }
        success seen {
            effect {
                motion -> Free
                lamp -> Off
            }
            postcondition motion == Free
        }
        failure {
            unseen {
                effect motion -> Free
                postcondition {
                    lit: lamp != Off
                    dry: weather == Dry or false
                }
            }
            lost {}
        }
    }

    skill {
        stop {
            precondition { used: motion == Used or motion == None }
            success { stopped { effect motion -> Free } }
        }
        wait {}
    }
}
