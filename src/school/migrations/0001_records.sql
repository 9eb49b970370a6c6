-- Records of a school: who did what, and what it was worth. Times are UTC; digests are SHA-256.

DO $$
DECLARE role text;
BEGIN
  FOREACH role IN ARRAY ARRAY['typodont_station', 'typodont_examiner', 'typodont_registrar', 'typodont_worker'] LOOP
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = role) THEN
      EXECUTE format('CREATE ROLE %I NOLOGIN', role);
    END IF;
  END LOOP;
END $$;

CREATE SCHEMA typodont;
CREATE TABLE typodont.migration (
  number integer PRIMARY KEY,
  name text NOT NULL,
  sha256 text NOT NULL,
  applied_at timestamptz NOT NULL DEFAULT now()
);
REVOKE ALL ON SCHEMA typodont FROM PUBLIC;
GRANT USAGE ON SCHEMA typodont TO typodont_station, typodont_examiner, typodont_registrar, typodont_worker;

-- A class and for how many days its sessions are kept; null keeps them. The name becomes a folder's.
CREATE TABLE typodont.class (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  name text NOT NULL UNIQUE CHECK (name ~ '^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$'),
  keep_days integer CHECK (keep_days BETWEEN 1 AND 36500),
  made_at timestamptz NOT NULL DEFAULT now()
);

-- People, by codes that are none's name. Who stands behind a code is known elsewhere.
CREATE TABLE typodont.participant (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  code text NOT NULL UNIQUE CHECK (code <> '')
);

CREATE TABLE typodont.exercise (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  sha256 text NOT NULL,
  name text NOT NULL,
  title text NOT NULL,
  UNIQUE (sha256, name)
);

-- A finished session. `result` is its session.json as the station wrote it; `manifest` says where its bundle's bytes lie.
CREATE TABLE typodont.session (
  id uuid PRIMARY KEY,
  station text NOT NULL DEFAULT session_user,
  class_id bigint NOT NULL REFERENCES typodont.class,
  participant_id bigint REFERENCES typodont.participant,
  exercise_id bigint NOT NULL REFERENCES typodont.exercise,
  -- A folder's name, and no way anywhere.
  bundle text NOT NULL CHECK (bundle !~ '[/\\]' AND bundle NOT IN ('.', '..')),
  started_at timestamptz,
  received_at timestamptz NOT NULL DEFAULT now(),
  ended_because text NOT NULL,
  length_s double precision NOT NULL,
  scorer_version bigint NOT NULL,
  points double precision,
  passed boolean,
  result text NOT NULL,
  manifest jsonb NOT NULL
);
CREATE INDEX session_by_class ON typodont.session (class_id, started_at);
CREATE INDEX session_by_participant ON typodont.session (participant_id);
CREATE INDEX session_by_exercise ON typodont.session (exercise_id);

-- What a worker's scorer made of a session's recording: the text that `typodont score` prints.
CREATE TABLE typodont.score (
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  scorer_version bigint NOT NULL,
  result text NOT NULL,
  -- Whether it says what the station said; null where the station scored by another version.
  agrees boolean,
  typodont_version text NOT NULL,
  scored_by text NOT NULL DEFAULT session_user,
  scored_at timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (session_id, scorer_version)
);

CREATE TABLE typodont.metric_value (
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  scorer_version bigint NOT NULL,
  metric text NOT NULL,
  value double precision,
  PRIMARY KEY (session_id, scorer_version, metric)
);

CREATE TABLE typodont.rating (
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  questionnaire text NOT NULL,
  place integer NOT NULL,
  item text NOT NULL,
  category text NOT NULL,
  value double precision,
  counted double precision,
  PRIMARY KEY (session_id, place)
);

-- A line of an examiner's log, word for word: each names the digest of the one before it.
CREATE TABLE typodont.override (
  log text NOT NULL,
  number bigint NOT NULL,
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  examiner text NOT NULL DEFAULT session_user,
  line text NOT NULL,
  sha256 text NOT NULL,
  received_at timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (log, number, sha256)
);
CREATE INDEX override_by_session ON typodont.override (session_id);

-- Work: score a session by a version. A lease that lapses is somebody else's.
CREATE TABLE typodont.job (
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  scorer_version bigint NOT NULL,
  state text NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'leased', 'done', 'set aside')),
  attempts integer NOT NULL DEFAULT 0,
  worker text,
  due_at timestamptz NOT NULL DEFAULT now(),
  error text,
  enqueued_at timestamptz NOT NULL DEFAULT now(),
  ended_at timestamptz,
  PRIMARY KEY (session_id, scorer_version)
);
CREATE INDEX job_due ON typodont.job (scorer_version, due_at) WHERE state IN ('waiting', 'leased');

-- What left the records, so that it can be found again when somebody is to be forgotten.
CREATE TABLE typodont.export (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  at timestamptz NOT NULL DEFAULT now(),
  login text NOT NULL DEFAULT session_user,
  what text NOT NULL,
  destination text NOT NULL,
  -- Whose scores it has: workers' of this version, or else the stations' own.
  scorer_version bigint
);
CREATE TABLE typodont.exported (
  export_id bigint NOT NULL REFERENCES typodont.export ON DELETE CASCADE,
  session_id uuid NOT NULL REFERENCES typodont.session ON DELETE CASCADE,
  PRIMARY KEY (export_id, session_id)
);
CREATE INDEX exported_by_session ON typodont.exported (session_id);

-- Who and what must not come back, as digests under this school's own salt: nobody can be read out of them.
CREATE TABLE typodont.salt (value bytea NOT NULL);
INSERT INTO typodont.salt VALUES (uuid_send(gen_random_uuid()) || uuid_send(gen_random_uuid()));
CREATE TABLE typodont.erased (digest bytea PRIMARY KEY, at timestamptz NOT NULL DEFAULT now());

-- Folders of the store and partitions of exports that an erasure has still to remove; empty when it is done.
CREATE TABLE typodont.erasing (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  kind text NOT NULL CHECK (kind IN ('bundle', 'export')),
  place text NOT NULL,
  part text NOT NULL DEFAULT ''
);

-- Who did what. A session that is erased is no longer named.
CREATE TABLE typodont.audit (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  at timestamptz NOT NULL DEFAULT clock_timestamp(),
  login text NOT NULL DEFAULT session_user,
  action text NOT NULL,
  session_id uuid REFERENCES typodont.session ON DELETE SET NULL,
  detail text NOT NULL DEFAULT ''
);
CREATE INDEX audit_by_session ON typodont.audit (session_id);
