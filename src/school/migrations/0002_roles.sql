-- Who may do what. A login belongs to one or several of the four roles; an examiner also to classes.

CREATE TABLE typodont.examines (
  login text NOT NULL,
  class_id bigint NOT NULL REFERENCES typodont.class ON DELETE CASCADE,
  PRIMARY KEY (login, class_id)
);

-- Functions that look or write where their caller may not. Each does one thing, and trusts no search path.

CREATE FUNCTION typodont.digest(kind text, word text) RETURNS bytea
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$ SELECT sha256(value || convert_to(kind || ':' || word, 'UTF8')) FROM typodont.salt $$;
REVOKE ALL ON FUNCTION typodont.digest FROM PUBLIC;

-- Of sessions by their ids: 'new', 'known' or 'erased'. A code that was erased makes its sessions erased ones.
CREATE FUNCTION typodont.standing_of(asked uuid, code text) RETURNS text
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
  SELECT CASE
    WHEN EXISTS (SELECT FROM typodont.session WHERE id = asked) THEN 'known'
    WHEN EXISTS (SELECT FROM typodont.erased WHERE digest IN
      (typodont.digest('session', asked::text), typodont.digest('participant', code))) THEN 'erased'
    ELSE 'new' END
$$;
REVOKE ALL ON FUNCTION typodont.standing_of FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.standing_of TO typodont_station;

-- The number of a participant, who is entered if new. Whoever was erased does not come back.
CREATE FUNCTION typodont.participant_of(asked text) RETURNS bigint
LANGUAGE plpgsql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE found bigint;
BEGIN
  -- An erasure of the same person waits, or is seen.
  PERFORM pg_advisory_xact_lock_shared(7368, hashtext(asked));
  IF EXISTS (SELECT FROM typodont.erased WHERE digest = typodont.digest('participant', asked)) THEN
    RAISE EXCEPTION 'the participant was erased' USING ERRCODE = 'TY001';
  END IF;
  INSERT INTO typodont.participant (code) VALUES (asked) ON CONFLICT (code) DO NOTHING RETURNING id INTO found;
  IF found IS NULL THEN
    -- Held, so that nobody removes it as one without sessions before ours is there.
    SELECT id INTO found FROM typodont.participant WHERE code = asked FOR KEY SHARE;
  END IF;
  RETURN found;
END $$;
REVOKE ALL ON FUNCTION typodont.participant_of FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.participant_of TO typodont_station;

CREATE FUNCTION typodont.exercise_of(asked_sha256 text, asked_name text, asked_title text) RETURNS bigint
LANGUAGE plpgsql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE found bigint;
BEGIN
  SELECT id INTO found FROM typodont.exercise WHERE sha256 = asked_sha256 AND name = asked_name;
  IF found IS NULL THEN
    INSERT INTO typodont.exercise (sha256, name, title) VALUES (asked_sha256, asked_name, asked_title)
      ON CONFLICT (sha256, name) DO NOTHING RETURNING id INTO found;
  END IF;
  IF found IS NULL THEN
    SELECT id INTO found FROM typodont.exercise WHERE sha256 = asked_sha256 AND name = asked_name;
  END IF;
  RETURN found;
END $$;
REVOKE ALL ON FUNCTION typodont.exercise_of FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.exercise_of TO typodont_station;

-- A line in the audit log, by whoever is logged in.
CREATE FUNCTION typodont.note(action text, detail text) RETURNS void
LANGUAGE sql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$ INSERT INTO typodont.audit (action, detail) VALUES (action, left(detail, 1000)) $$;
REVOKE ALL ON FUNCTION typodont.note FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.note TO typodont_station, typodont_examiner, typodont_registrar, typodont_worker;

CREATE FUNCTION typodont.note_session(action text, session uuid) RETURNS void
LANGUAGE sql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$ INSERT INTO typodont.audit (action, session_id) VALUES (action, session) $$;
REVOKE ALL ON FUNCTION typodont.note_session FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.note_session TO typodont_worker;

CREATE FUNCTION typodont.note_change() RETURNS trigger
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
  IF TG_TABLE_NAME = 'session' THEN
    INSERT INTO typodont.audit (action, session_id) VALUES ('session received', NEW.id);
  ELSE
    INSERT INTO typodont.audit (action, session_id) VALUES ('override received', NEW.session_id);
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER audited AFTER INSERT ON typodont.session FOR EACH ROW EXECUTE FUNCTION typodont.note_change();
CREATE TRIGGER audited AFTER INSERT ON typodont.override FOR EACH ROW EXECUTE FUNCTION typodont.note_change();

-- Takes sessions out of the records, and writes down what is left to remove elsewhere. Gives how many.
CREATE FUNCTION typodont.erase_sessions(chosen uuid[], why text) RETURNS bigint
LANGUAGE plpgsql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE gone bigint;
BEGIN
  PERFORM FROM typodont.session WHERE id = ANY (chosen) FOR UPDATE;
  INSERT INTO typodont.erasing (kind, place)
    SELECT 'bundle', manifest->>'folder' FROM typodont.session WHERE id = ANY (chosen);
  INSERT INTO typodont.erasing (kind, place, part)
    SELECT DISTINCT 'export', e.destination,
      'class=' || c.name || '/month=' || coalesce(to_char(s.started_at AT TIME ZONE 'UTC', 'YYYY-MM'), 'unknown')
    FROM typodont.exported x
    JOIN typodont.export e ON e.id = x.export_id
    JOIN typodont.session s ON s.id = x.session_id
    JOIN typodont.class c ON c.id = s.class_id
    WHERE s.id = ANY (chosen);
  INSERT INTO typodont.erased (digest)
    SELECT typodont.digest('session', id::text) FROM typodont.session WHERE id = ANY (chosen)
    ON CONFLICT DO NOTHING;
  DELETE FROM typodont.session WHERE id = ANY (chosen);
  GET DIAGNOSTICS gone = ROW_COUNT;
  DELETE FROM typodont.participant p WHERE NOT EXISTS (SELECT FROM typodont.session WHERE participant_id = p.id);
  INSERT INTO typodont.audit (action, detail) VALUES ('erased', gone || ' sessions: ' || why);
  RETURN gone;
END $$;
REVOKE ALL ON FUNCTION typodont.erase_sessions FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.erase_sessions TO typodont_registrar;

-- Forgets a participant for good. Gives how many sessions went.
CREATE FUNCTION typodont.erase_participant(asked text) RETURNS bigint
LANGUAGE plpgsql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE own uuid[];
BEGIN
  PERFORM pg_advisory_xact_lock(7368, hashtext(asked));
  INSERT INTO typodont.erased (digest) VALUES (typodont.digest('participant', asked)) ON CONFLICT DO NOTHING;
  SELECT coalesce(array_agg(s.id), '{}') INTO own FROM typodont.session s
    JOIN typodont.participant p ON p.id = s.participant_id WHERE p.code = asked;
  RETURN typodont.erase_sessions(own, 'a participant asked to be forgotten');
END $$;
REVOKE ALL ON FUNCTION typodont.erase_participant FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.erase_participant TO typodont_registrar;

-- Sessions that their class no longer keeps. Gives how many there are, or were.
CREATE FUNCTION typodont.outlived() RETURNS SETOF uuid
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
  SELECT s.id FROM typodont.session s JOIN typodont.class c ON c.id = s.class_id
  WHERE coalesce(s.started_at, s.received_at) < now() - make_interval(days => c.keep_days)
$$;
REVOKE ALL ON FUNCTION typodont.outlived FROM PUBLIC;
GRANT EXECUTE ON FUNCTION typodont.outlived TO typodont_registrar;

-- What each role is granted on whole tables; rows are narrowed below.
GRANT SELECT ON typodont.migration, typodont.class, typodont.exercise TO
  typodont_station, typodont_examiner, typodont_registrar, typodont_worker;
GRANT SELECT, INSERT ON typodont.session, typodont.metric_value, typodont.rating TO typodont_station;
GRANT SELECT ON typodont.session, typodont.score, typodont.metric_value, typodont.rating, typodont.override TO
  typodont_examiner, typodont_registrar;
GRANT INSERT ON typodont.override TO typodont_examiner;
GRANT SELECT ON typodont.participant TO typodont_registrar, typodont_examiner;
GRANT SELECT ON typodont.examines TO typodont_examiner, typodont_registrar;
GRANT INSERT, UPDATE ON typodont.class TO typodont_registrar;
GRANT SELECT, INSERT ON typodont.export, typodont.exported TO typodont_registrar;
GRANT DELETE ON typodont.export TO typodont_registrar;
GRANT SELECT, DELETE ON typodont.erasing TO typodont_registrar;
GRANT SELECT ON typodont.audit TO typodont_registrar;
GRANT SELECT ON typodont.job TO typodont_registrar;
GRANT INSERT ON typodont.job TO typodont_registrar, typodont_worker;
GRANT SELECT ON typodont.session TO typodont_worker;
GRANT SELECT, UPDATE ON typodont.job TO typodont_worker;
GRANT SELECT, INSERT ON typodont.score, typodont.metric_value TO typodont_worker;
GRANT DELETE ON typodont.metric_value TO typodont_worker;

ALTER TABLE typodont.session ENABLE ROW LEVEL SECURITY;
ALTER TABLE typodont.score ENABLE ROW LEVEL SECURITY;
ALTER TABLE typodont.metric_value ENABLE ROW LEVEL SECURITY;
ALTER TABLE typodont.rating ENABLE ROW LEVEL SECURITY;
ALTER TABLE typodont.override ENABLE ROW LEVEL SECURITY;
ALTER TABLE typodont.participant ENABLE ROW LEVEL SECURITY;

CREATE POLICY station_reads_own ON typodont.session FOR SELECT TO typodont_station USING (station = session_user);
CREATE POLICY station_writes_own ON typodont.session FOR INSERT TO typodont_station
  WITH CHECK (station = session_user AND received_at = now() AND manifest->>'folder' = session_user || '/' || id::text);
CREATE POLICY station_reads_own ON typodont.metric_value FOR SELECT TO typodont_station
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id AND s.station = session_user));
-- With its session, in one step, or not at all.
CREATE POLICY station_writes_own ON typodont.metric_value FOR INSERT TO typodont_station
  WITH CHECK (EXISTS (SELECT FROM typodont.session s
    WHERE s.id = session_id AND s.station = session_user AND s.received_at = now()
      AND s.scorer_version = metric_value.scorer_version));
CREATE POLICY station_reads_own ON typodont.rating FOR SELECT TO typodont_station
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id AND s.station = session_user));
CREATE POLICY station_writes_own ON typodont.rating FOR INSERT TO typodont_station
  WITH CHECK (EXISTS (SELECT FROM typodont.session s
    WHERE s.id = session_id AND s.station = session_user AND s.received_at = now()));

CREATE POLICY examiner_reads_class ON typodont.session FOR SELECT TO typodont_examiner
  USING (class_id IN (SELECT e.class_id FROM typodont.examines e WHERE e.login = session_user));
CREATE POLICY examiner_reads_class ON typodont.score FOR SELECT TO typodont_examiner
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY examiner_reads_class ON typodont.metric_value FOR SELECT TO typodont_examiner
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY examiner_reads_class ON typodont.rating FOR SELECT TO typodont_examiner
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY examiner_reads_class ON typodont.override FOR SELECT TO typodont_examiner
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY examiner_writes_class ON typodont.override FOR INSERT TO typodont_examiner
  WITH CHECK (examiner = session_user AND EXISTS (SELECT FROM typodont.session s WHERE s.id = session_id));
CREATE POLICY examiner_reads_class ON typodont.participant FOR SELECT TO typodont_examiner
  USING (EXISTS (SELECT FROM typodont.session s WHERE s.participant_id = participant.id));

CREATE POLICY registrar_reads ON typodont.session FOR SELECT TO typodont_registrar USING (true);
CREATE POLICY registrar_reads ON typodont.score FOR SELECT TO typodont_registrar USING (true);
CREATE POLICY registrar_reads ON typodont.metric_value FOR SELECT TO typodont_registrar USING (true);
CREATE POLICY registrar_reads ON typodont.rating FOR SELECT TO typodont_registrar USING (true);
CREATE POLICY registrar_reads ON typodont.override FOR SELECT TO typodont_registrar USING (true);
CREATE POLICY registrar_reads ON typodont.participant FOR SELECT TO typodont_registrar USING (true);

CREATE POLICY worker_reads ON typodont.session FOR SELECT TO typodont_worker USING (true);
CREATE POLICY worker_reads ON typodont.score FOR SELECT TO typodont_worker USING (true);
CREATE POLICY worker_writes ON typodont.score FOR INSERT TO typodont_worker WITH CHECK (true);
CREATE POLICY worker_reads ON typodont.metric_value FOR SELECT TO typodont_worker USING (true);
CREATE POLICY worker_writes ON typodont.metric_value FOR INSERT TO typodont_worker WITH CHECK (true);
CREATE POLICY worker_replaces ON typodont.metric_value FOR DELETE TO typodont_worker USING (true);
